//! LK figures 1, 3b, 5 and 6: what their pictures show, in numbers.

use crate::document::{Against, Agreement, Section};
use crate::results::figures::show;
use crate::results::plain;
use crate::results::ratios::{above, below};
use screendoor_study::metrics::Estimate;
use screendoor_study::study::publications::{
    BLOCKS, CORRELATION_SEEDS, EdgeNoise, FarSamples, Noise, Publications,
};

fn of<'a>(list: &'a [Noise], design: &str) -> Option<&'a Noise> {
    list.iter().find(|n| n.design == design)
}

/// A pair of designs whose noise is held against each other.
fn pair<'a>(list: &'a [Noise], designs: [&str; 2]) -> Option<[&'a Noise; 2]> {
    Some([of(list, designs[0])?, of(list, designs[1])?])
}

/// RMSE over blocks of pixels, and by how much it falls; panels named where several.
fn blocks(section: &mut Section, panels: &[(&str, &[Noise])]) {
    let named = panels.len() > 1;
    let sizes = BLOCKS.map(|b| format!("{b}×{b}"));
    let mut header = if named { vec!["panel", "design"] } else { vec!["design"] };
    header.extend(sizes.iter().map(String::as_str));
    let fall = format!("{} ÷ {}", sizes[0], sizes[BLOCKS.len() - 1]);
    header.push(&fall);
    let all = panels.iter().flat_map(|(panel, list)| list.iter().map(move |noise| (panel, noise)));
    let rows = all.map(|(panel, noise)| {
        let mut row = if named { vec![panel.to_string()] } else { Vec::new() };
        row.push(format!("`{}`", noise.design));
        row.extend(noise.rmse.iter().map(|e| plain(*e)));
        row.push(interval(noise.fall(), 1));
        row
    });
    section.table(header, rows);
}

/// An estimate with its interval's ends.
fn interval(e: Estimate, decimals: usize) -> String {
    if e.high.is_finite() {
        format!("{:.decimals$} [{:.decimals$}, {:.decimals$}]", e.value, e.low, e.high)
    } else {
        format!("{:.decimals$} [?]", e.value)
    }
}

const DESIGNS: [&str; 2] = ["enderton", "lk"];

/// Figure 1: dithering, edges, layers.
fn figure_1(p: &Publications) -> Against {
    let noise = &p.noise;
    let falls = pair(&noise.dithering, DESIGNS).map(|pair| pair.map(Noise::fall));
    let edges = DESIGNS.map(|d| noise.edges.iter().find(|e| e.design == d));
    let cloth = pair(&noise.cloth, DESIGNS).map(|[e, lk]| lk.rmse[0].ratio(e.rmse[0]));
    let noisier = |e: &EdgeNoise| e.edges.low > e.inside.high;
    let dithers = falls.is_some_and(|[e, lk]| lk.low > e.high);
    let even = matches!(edges, [Some(e), Some(lk)] if noisier(e) && !noisier(lk));
    let layers = cloth.is_some_and(|ratio| below(ratio, 1.0));
    let number = |e: Option<Estimate>, decimals| e.map_or("—".into(), |e| interval(e, decimals));
    let found = |holds, text: &str| format!("{text}: {}", if holds { "yes" } else { "no" });
    let [e_edge, lk_edge] = edges.map(|e| e.map_or("—".to_string(), |e| plain(e.edges)));
    Against {
        section: "LK figure 1".to_string(),
        source: "Laine and Karras 2011, figure 1".to_string(),
        printed: "Pictures. The comparison's noise is clumpy, there are problems at primitives' \
                  edges, and its stratification degrades where layers overlap; LK dithers \
                  properly, has no edge artifacts and is better stratified over several layers."
            .to_string(),
        measured: format!(
            "Averaged over 8 × 8 pixels the noise of the ramps falls by {} with `lk`, by {} with \
             `enderton`; where quads meet the RMSE is {lk_edge} and {e_edge}; on the cloth `lk` ÷ \
             `enderton` is {}.",
            number(falls.map(|f| f[1]), 1),
            number(falls.map(|f| f[0]), 1),
            number(cloth, 3)
        ),
        agreement: Agreement::of(&[dithers, even, layers]),
        remark: format!(
            "{}.",
            [
                found(dithers, "Noise of `lk` falls faster under averaging"),
                found(even, "edges add noise to `enderton` alone"),
                found(layers, "less noise of `lk` on overlapping layers"),
            ]
            .join("; ")
        ),
    }
}

/// Figure 1's section.
pub(super) fn figure_1_section(p: &Publications) -> Option<Section> {
    let mut section = Section::answering(figure_1(p));
    section.paragraph(format!(
        "RMSE in 8-bit units, after the picture and the exact one are averaged over blocks of \
         pixels; {} seeds. Noise without spatial stratification halves as the block's side \
         doubles (8 in all), dithered noise falls faster.",
        p.effort.seeds
    ));
    blocks(
        &mut section,
        &[("ramps, 16 samples", &p.noise.dithering), ("cloth, 64 samples", &p.noise.cloth)],
    );
    section.paragraph("The lower part of the ramps, alpha 0.75 drawn as five quads:");
    let row = |e: &EdgeNoise| [format!("`{}`", e.design), plain(e.edges), plain(e.inside)];
    let header = ["design", "where triangles meet", "elsewhere"];
    section.table(header, p.noise.edges.iter().map(row));
    show(&mut section, &p.pictures, &["figure-1", "figure-1-cloth"]);
    Some(section)
}

/// The reference values of figure 3a and 3b, fixed to samples as in section 3.
const FIXED: [&str; 2] =
    ["lk:sort=false,compact=false", "lk:reference=sobol,sort=false,compact=false"];

/// Figure 3b: correlations that the Sobol' sequence leaves.
fn figure_3b(p: &Publications) -> Against {
    let falls = pair(&p.noise.correlation, FIXED).map(|pair| pair.map(Noise::fall));
    let left = pair(&p.noise.correlation, FIXED).map(|[hash, sobol]| {
        let last = BLOCKS.len() - 1;
        sobol.rmse[last].ratio(hash.rmse[last])
    });
    let remains = left.is_some_and(|ratio| above(ratio, 1.0));
    let number = |e: Option<Estimate>, decimals| e.map_or("—".into(), |e| interval(e, decimals));
    Against {
        section: "LK figure 3b".to_string(),
        source: "Laine and Karras 2011, section 3, figure 3".to_string(),
        printed: "Pictures of eight white layers. (a) With a generic hash disjoint spans of the \
                  sequence are uncorrelated; (b) with the Sobol' sequence significant correlations \
                  remain when several surfaces are drawn."
            .to_string(),
        measured: format!(
            "Averaged over 8 × 8 pixels the error falls by {} with the hash, by {} with the Sobol' \
             sequence; there Sobol' ÷ hash is {}.",
            number(falls.map(|f| f[0]), 1),
            number(falls.map(|f| f[1]), 1),
            number(left, 2)
        ),
        agreement: Agreement::of(&[remains]),
        remark: format!(
            "What pixels have in common does not average out; the Sobol' sequence leaves {} of it \
             than the hash.",
            if remains { "more" } else { "no more" }
        ),
    }
}

/// Figure 3's section.
pub(super) fn figure_3b_section(p: &Publications) -> Option<Section> {
    let mut section = Section::answering(figure_3b(p));
    section.paragraph(format!(
        "Eight white layers of alpha 0.1 at 8 samples; RMSE in 8-bit units after averaging over \
         blocks of pixels, {CORRELATION_SEEDS} seeds. `sort=false,compact=false` fixes reference \
         values to samples, as in section 3 of the paper. What is left over blocks of 8 × 8 pixels \
         is common to many pixels of a frame; it changes from seed to seed."
    ));
    blocks(&mut section, &[("", &p.noise.correlation)]);
    show(&mut section, &p.pictures, &["figure-3"]);
    Some(section)
}

/// Figure 5: samples left to a far surface.
fn figure_5(p: &Publications) -> Against {
    let right = |f: &FarSamples| f.range == [4, 4];
    let parts = |part: &str| p.far_samples.iter().filter(|f| f.part == part).collect::<Vec<_>>();
    let exact = |part: &str| !parts(part).is_empty() && parts(part).iter().all(|f| right(f));
    let varies = |part: &str| parts(part).iter().any(|f| !right(f));
    let range = |part: &str| {
        let list = parts(part);
        let low = list.iter().map(|f| f.range[0]).min();
        let high = list.iter().map(|f| f.range[1]).max();
        low.zip(high).map_or("—".to_string(), |(low, high)| format!("{low} to {high}"))
    };
    let statements = [varies("a"), exact("b"), varies("c"), exact("d")];
    let holding: Vec<String> = ["a", "b", "c", "d"]
        .iter()
        .zip(statements)
        .map(|(part, holds)| format!("({part}) {}", if holds { "as printed" } else { "not so" }))
        .collect();
    Against {
        section: "LK figure 5".to_string(),
        source: "Laine and Karras 2011, section 4, figure 5".to_string(),
        printed: "Of 16 samples two surfaces of alpha 0.5 should leave the far one 4. (a) Without \
                  correlation between surfaces 0 to 8; (b) with the survivors of the depth test \
                  numbered, 4 from near to far; (c) not from far to near; (d) with sorting, 4 \
                  again."
            .to_string(),
        measured: format!(
            "(a) {}, (b) {}, (c) {}, (d) {}.",
            range("a"),
            range("b"),
            range("c"),
            range("d")
        ),
        agreement: Agreement::of(&statements),
        remark: format!("{}.", holding.join(", ")),
    }
}

/// Figure 5's section.
pub(super) fn figure_5_section(p: &Publications) -> Option<Section> {
    let mut section = Section::answering(figure_5(p));
    section.paragraph(
        "Samples that a surface of alpha 0.5 keeps under another one of alpha 0.5, of 16: fewest \
         and most over 64 × 64 pixels. The right number is 4.",
    );
    let row = |f: &FarSamples| {
        let order = if f.near_first { "near to far" } else { "far to near" };
        [
            if f.part.is_empty() { String::new() } else { format!("({})", f.part) },
            format!("`{}`", f.design),
            order.to_string(),
            format!("{} to {}", f.range[0], f.range[1]),
        ]
    };
    section.table(["part", "design", "drawn", "samples"], p.far_samples.iter().map(row));
    Some(section)
}

/// Figure 6: the sort.
fn figure_6(p: &Publications) -> Against {
    let found = pair(&p.noise.sorting, ["lk:sort=false", "lk"]);
    let gain = found.map(|[without, with]| without.rmse[0].ratio(with.rmse[0]));
    let noisier = gain.is_some_and(|gain| above(gain, 1.0));
    let value = |i: usize| found.map_or("—".to_string(), |pair| plain(pair[i].rmse[0]));
    Against {
        section: "LK figure 6".to_string(),
        source: "Laine and Karras 2011, section 4, figure 6".to_string(),
        printed: "Pictures of a cloth of several layers, its triangles in random order. Without \
                  the sort the result is more noisy where surfaces are drawn far to near."
            .to_string(),
        measured: format!(
            "RMSE {} without the sort, {} with it: {} times.",
            value(0),
            value(1),
            gain.map_or("—".into(), |gain| interval(gain, 3))
        ),
        agreement: Agreement::of(&[noisier]),
        remark: format!(
            "Without the sort there is {} noise in the detail as a whole.",
            if noisier { "more" } else { "no more" }
        ),
    }
}

/// Figure 6's section.
pub(super) fn figure_6_section(p: &Publications) -> Option<Section> {
    let mut section = Section::answering(figure_6(p));
    section.paragraph(format!(
        "A detail of `builtin:cloth` at 16 samples, triangles in random order, {} seeds: RMSE in \
         8-bit units, also averaged over blocks of pixels.",
        p.effort.seeds
    ));
    blocks(&mut section, &[("", &p.noise.sorting)]);
    show(&mut section, &p.pictures, &["figure-6"]);
    Some(section)
}
