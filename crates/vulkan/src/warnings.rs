//! What a user has to know of a conversion.

use ash::vk;

use crate::convert::{Conversion, Converted};
use crate::depth::DepthRule;
use crate::plan::{Act, Plan};

/// All there is to warn of, in sentences for one line each.
pub(crate) fn of(
    conversion: &Conversion<'_>,
    plan: &Plan<'_>,
    converted: &Converted,
) -> Vec<String> {
    let mut told = Vec::new();
    let dropped = &converted.dropped;
    for refusal in &converted.refused {
        let draws = plural(refusal.draws, "draw");
        let fragments = plural(refusal.fragments, "fragment");
        told.push(format!("{draws} ({fragments}) not in the trace: {}", refusal.why));
    }
    let counted = [
        (dropped.additive, "add light and hold none back: not in the trace"),
        (dropped.coloured, "have an alpha for each channel: not in the trace"),
        (dropped.beyond, "have an alpha that is not 0 to 1: not in the trace"),
        (dropped.uncovered, "cover none of the target's samples: not in the trace"),
        (
            dropped.not_finite,
            "have a colour that is infinite or no number: it became the greatest, or 0",
        ),
        (
            dropped.flattened,
            "have depths too steep for a trace or outside of 0 to 1: they are flat",
        ),
        (dropped.painted_over, "were drawn before all was cleared: not in the trace"),
    ];
    for (count, what) in counted.into_iter().filter(|(count, _)| *count > 0) {
        told.push(format!("{} {what}", plural(count, "fragment")));
    }
    if plan.partial_clears > 0 && converted.depth != DepthRule::Order {
        told.push(format!(
            "a part of the target was cleared {}: the trace still has what was there \
             (--depth order draws over it)",
            times(plan.partial_clears)
        ));
    }
    for ((drawn, command), count) in &plan.writes {
        let when = match drawn {
            true => "after the first draw: the trace does not show it",
            false => "before the first draw",
        };
        told.push(format!("the target was written by {command} {} {when}", times(*count)));
    }
    if plan.others > 0 {
        told.push(format!(
            "{} beside the target: the trace has that of location {} alone, and what the program \
             makes of the others is not known",
            plural(plan.others.into(), "colour attachment"),
            conversion.chosen.capture.device.location
        ));
    }
    if converted.depth == DepthRule::Program {
        of_program_depth(plan, &mut told);
    }
    if converted.objects.is_empty() {
        told.push("no fragment of a draw is in the trace".to_string());
    }
    told
}

/// What the program's own depths do not tell.
fn of_program_depth(plan: &Plan<'_>, told: &mut Vec<String>) {
    let mend = "--depth order keeps the order of drawing";
    let untested = plan.kept().filter(|p| p.tested().is_none());
    let (draws, fragments) = untested.fold((0, 0), |(d, f), p| (d + 1, f + p.records));
    if fragments > 0 {
        let (draws, fragments) = (plural(draws, "draw"), plural(fragments, "fragment"));
        told.push(format!("{draws} ({fragments}) test no depth, but have one: {mend}"));
    }
    let (_, against) = plan.reversed();
    if against > 0 {
        let fragments = plural(against, "fragment");
        told.push(format!("{fragments} are tested for greater depths, others for less: {mend}"));
    }
    let (mut begun, mut again) = (false, 0);
    for act in &plan.acts {
        match act {
            Act::Draw(planned) => begun |= planned.tested().is_some(),
            Act::Paint(..) => {}
            Act::ClearDepth(..) => again += u64::from(begun),
            Act::Begin(_, depth) => {
                let clears = depth.load == vk::AttachmentLoadOp::CLEAR.as_raw();
                again += u64::from(begun && clears);
            }
        }
    }
    if again > 0 {
        let times = times(again);
        told.push(format!("depth was cleared {times} between draws: {mend}"));
    }
}

fn plural(count: u64, what: &str) -> String {
    format!("{count} {what}{}", if count == 1 { "" } else { "s" })
}

fn times(count: u64) -> String {
    if count == 1 { "once".to_string() } else { format!("{count} times") }
}
