//! What a fragment shader reads and writes that a record tells of.

use super::Options;
use super::editor::{BuiltIn, Editor};
use super::spec::{built_in, capability, class, decoration, mode, op};

/// Inputs that a record needs.
pub(super) struct Inputs {
    pub(super) position: BuiltIn,
    pub(super) mask: BuiltIn,
    pub(super) front: BuiltIn,
    /// Where the shader asks which sample it is run for: that.
    pub(super) sample: Option<BuiltIn>,
    pub(super) primitive: Option<BuiltIn>,
    pub(super) instance: Option<BuiltIn>,
}

impl Inputs {
    pub(super) fn declare(e: &mut Editor, options: &Options) -> Self {
        let (uint, float, bool) = (e.uint(), e.float(), e.bool());
        let floats = e.vector(float, 4);
        let position = e.built_in_input(built_in::FRAG_COORD, floats, false);
        let mask = match e.built_in(class::INPUT, built_in::SAMPLE_MASK) {
            Some(mask) => mask,
            None => {
                let mask = e.array(uint, 1);
                e.built_in_input(built_in::SAMPLE_MASK, mask, true)
            }
        };
        let front = e.built_in_input(built_in::FRONT_FACING, bool, false);
        // To ask where the shader does not would be to change how it is run.
        let sample = reads_sample(e).then(|| {
            e.capability(capability::SAMPLE_RATE_SHADING);
            e.built_in_input(built_in::SAMPLE_ID, uint, true)
        });
        let primitive = options.primitive_id.then(|| {
            if !e.declared.capabilities.contains(&capability::TESSELLATION) {
                e.capability(capability::GEOMETRY);
            }
            e.built_in_input(built_in::PRIMITIVE_ID, uint, true)
        });
        let instance = options.instance.map(|location| {
            let variable = e.variable(class::INPUT, uint);
            e.decorate(variable, &[decoration::LOCATION, location]);
            e.decorate(variable, &[decoration::FLAT]);
            BuiltIn { variable, member: None, ty: uint }
        });
        Self { position, mask, front, sample, primitive, instance }
    }
}

/// Whether the shader may be run for each sample because of its inputs.
///
/// Whether one that is declared but never read counts too is left to drivers; Mesa's are of that
/// opinion. Without slopes the record is right either way.
pub(super) fn is_per_sample(e: &Editor) -> bool {
    [built_in::SAMPLE_ID, built_in::SAMPLE_POSITION]
        .iter()
        .any(|which| e.built_in(class::INPUT, *which).is_some())
        || e.entry.interface.iter().any(|id| {
            e.declared.variables.get(id).is_some_and(|variable| {
                variable.class == class::INPUT
                    && (e.declared.decoration(*id, decoration::SAMPLE).is_some()
                        || e.declared.samples(variable.to))
            })
        })
}

/// Whether it is certain to be run for each sample, since it asks for which one it is.
fn reads_sample(e: &Editor) -> bool {
    let used = |built_in: BuiltIn| e.entry.used.contains(&built_in.variable);
    [built_in::SAMPLE_ID, built_in::SAMPLE_POSITION]
        .iter()
        .any(|which| e.built_in(class::INPUT, *which).is_some_and(used))
}

/// Outputs that change what is recorded, where the shader writes them.
pub(super) struct Written {
    pub(super) depth: Option<BuiltIn>,
    pub(super) mask: Option<BuiltIn>,
}

impl Written {
    pub(super) fn find(e: &Editor) -> Self {
        let written =
            |which| e.built_in(class::OUTPUT, which).filter(|b| e.entry.used.contains(&b.variable));
        // After early tests it is too late for another depth.
        let too_late = has_mode(e, mode::EARLY_FRAGMENT_TESTS)
            && !has_mode(e, mode::EARLY_AND_LATE_FRAGMENT_TESTS);
        Self {
            depth: written(built_in::FRAG_DEPTH).filter(|_| !too_late),
            mask: written(built_in::SAMPLE_MASK),
        }
    }
}

/// Whether the entry point has an execution mode.
pub(super) fn has_mode(e: &Editor, mode: u32) -> bool {
    e.module.declarations().iter().any(|i| {
        i.op() == op::EXECUTION_MODE
            && i.operand(0) == Ok(e.entry.function)
            && i.operand(1) == Ok(mode)
    })
}
