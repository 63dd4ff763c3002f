//! Whether what is declared unbiased is.

use std::fmt::Write;

use crate::metrics::student_t;
use crate::report::markdown_table;
use crate::report::results::plain;
use crate::study::publications::{DESIGNS, MeanError, Publications};

/// The section; nothing where no expectations were measured.
pub(super) fn text(text: &mut String, p: &Publications) {
    if p.means.is_empty() {
        return;
    }
    let seeds = p.effort.seeds_of_means as usize;
    let deviation = |m: &MeanError| m.mean.standard_errors(seeds);
    let lk = p.means.iter().filter(|m| m.design == DESIGNS[0]).map(deviation);
    let deviations: Vec<f64> = p.means.iter().filter(|m| m.unbiased).map(deviation).collect();
    let _ = writeln!(
        text,
        "## Is it unbiased?\n\n\
         Mean of picture minus exact over the covered pixels of the first CLOTH scene at 256 × 256 \
         pixels, over {} seeds. The paper takes LK figure 7 to be unbiased. It is not quite: \
         where primitives' edges share pixels in mixed order, chance decides which fragments \
         belong to one surface. A fragment that covers samples A and B of the current surface's \
         pixel, of which that surface holds A: if the surface was *written* to A and is nearer, A \
         fails the depth test, no conflict is seen, and B is numbered into the same surface, with \
         a reference value complementary to A's low one, thus rather high. If it was not written, \
         the conflict is seen and B gets a fresh value. On average B passes too rarely. Below \
         `lk` is off by up to {:.1} standard errors.\n\n\
         Where the tracking sees all covered samples, before the depth test (`track=covered`: a \
         counter of log2(N)+1 bits more per pixel), and in every other variant in which chance \
         does not decide the surface, there is no such bias: the largest deviation of a design \
         declared unbiased is {:.1} standard errors, where chance alone would exceed {:.1} in \
         one of a hundred such tables.\n",
        p.effort.seeds_of_means,
        lk.fold(0.0, f64::max),
        deviations.iter().copied().fold(0.0, f64::max),
        student_t(1.0 - 0.01 / deviations.len().max(1) as f64, seeds)
    );
    let rows: Vec<Vec<String>> = p
        .means
        .iter()
        .map(|m| {
            let outside = m.mean.low > 0.0 || m.mean.high < 0.0;
            vec![
                format!("`{}`", m.design),
                m.samples.to_string(),
                format!("{:+.4} ± {:.4}", m.mean.value, m.mean.half_width()),
                if outside { format!("{:.1} σ", deviation(m)) } else { "within".to_string() },
                plain(m.rmse),
                if m.unbiased { "unbiased" } else { "biased" }.to_string(),
            ]
        })
        .collect();
    let header = ["design", "samples", "mean error", "off 0", "RMSE", "declared"];
    text.push_str(&markdown_table(&header, &rows));
    let _ = writeln!(
        text,
        "\n(σ: standard errors; 'within' is within the 95 % interval, one of twenty is expected \
         outside by chance.)\n"
    );
}
