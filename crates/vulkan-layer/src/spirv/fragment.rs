//! Fragment shaders that leave a record of each fragment.

use super::colour::Colour;
use super::declared::Type;
use super::editor::{BuiltIn, Editor};
use super::inputs::{Inputs, Written, has_mode, is_per_sample};
use super::module::{Module, Result};
use super::record::{Buffers, Record};
use super::spec::{built_in, capability, class, decoration, memory, mode, model, op};
use super::{Facts, Options};

/// Bit of [`crate::log::Record::coverage`] that says that the front is seen.
const FRONT: u32 = 1 << 31;

/// A fragment shader that does what it did, then appends a [`crate::log::Record`], and what is to
/// be known of it.
///
/// Why it cannot be made is said in one line.
///
/// # What it costs where nothing is recorded
///
/// The old entry point is called, then one word of the header is read and compared. All else
/// happens only where it says so, but for two things. Where invocations can end within the old
/// entry point (`discard` as `OpKill`), the slopes of depth are taken before it, since a derivative
/// needs its neighbours: two differences, which is less than to wait for the word there. And the
/// inputs are there whether they are read or not, and a shader that can write to memory is run
/// before the depth test; that is in the shader's nature, not in what it executes.
pub fn fragment(
    words: &[u32],
    entry: &str,
    options: &Options,
) -> std::result::Result<(Vec<u32>, Facts), String> {
    let module = Module::parse(words)?;
    let mut e = Editor::new(&module, model::FRAGMENT, entry)?;
    refuse(&e, options)?;
    let has = |wanted: &[u32]| module.bodies().iter().any(|i| wanted.contains(&i.op()));
    let kills = has(&[op::KILL, op::TERMINATE_INVOCATION]);
    let demotes = has(&[op::DEMOTE_TO_HELPER_INVOCATION]);
    let colour = Colour::find(&e, options.location)?;
    let inputs = Inputs::declare(&mut e, options);
    let written = Written::find(&e);
    let facts = Facts {
        early_tests: has_mode(&e, mode::EARLY_FRAGMENT_TESTS)
            || has_mode(&e, mode::EARLY_AND_LATE_FRAGMENT_TESTS),
        per_sample: is_per_sample(&e),
        writes_depth: written.depth.is_some(),
        writes_mask: written.mask.is_some(),
        output: colour.output,
    };
    // A depth that the shader gives, or that of one sample, has no slopes.
    let sloped = !facts.writes_depth && !facts.per_sample;

    let buffers = Buffers::declare(&mut e, options.set, options.address);
    let function = e.begin();
    let early = if kills && sloped { Some(Position::load(&mut e, &inputs, true)?) } else { None };
    e.call();
    let enabled = buffers.enabled(&mut e);
    let recorded = e.begin_if(enabled);
    // All of a draw is here or nothing: derivatives are as good as outside.
    let position = match early {
        Some(position) => position,
        None => Position::load(&mut e, &inputs, sloped)?,
    };
    let coverage = coverage(&mut e, &inputs, &written)?;
    let counts = counts(&mut e, coverage, demotes);
    let covered = e.begin_if(counts);
    let record = Record {
        whose: [
            position.place(&mut e),
            buffers.slot(&mut e),
            match inputs.primitive {
                Some(primitive) => e.load_integer(class::INPUT, primitive, "gl_PrimitiveID")?,
                None => e.constant(0),
            },
            match inputs.instance {
                Some(instance) => {
                    e.load_integer(class::INPUT, instance, "the instance's number")?
                }
                None => e.constant(0),
            },
        ],
        depth: {
            let front = front(&mut e, &inputs)?;
            let uint = e.uint();
            let coverage = e.value(op::BITWISE_OR, uint, &[coverage, front]);
            let [z, dzdx, dzdy] = position.depth(&mut e, written.depth)?;
            [coverage, z, dzdx, dzdy]
        },
        colour: colour.load(&mut e),
    };
    buffers.append(&mut e, &record);
    e.end_if(covered);
    e.end_if(recorded);
    Ok((e.finish(function)?, facts))
}

/// What cannot be recorded, or not with these options.
fn refuse(e: &Editor, options: &Options) -> Result<()> {
    let rates = [built_in::SHADING_RATE, built_in::FRAG_SIZE, built_in::FRAG_INVOCATION_COUNT];
    if rates.iter().any(|rate| e.built_in(class::INPUT, *rate).is_some()) {
        return Err("shading rate: the shader's fragments may be of several pixels".into());
    }
    if e.declared.values(decoration::DESCRIPTOR_SET).any(|set| set == options.set) {
        return Err(format!("descriptor set {} is the module's own", options.set));
    }
    if let Some(location) = options.instance {
        e.require_free(class::INPUT, location)?;
    }
    let addressing = e.module.addressing();
    let known = [Some(memory::LOGICAL), Some(memory::PHYSICAL_STORAGE_BUFFER_64)];
    if options.address && !known.contains(&addressing) {
        return Err("the module's addressing model is not known".into());
    }
    Ok(())
}

/// Where a fragment lies.
struct Position {
    /// `gl_FragCoord`.
    at: u32,
    z: u32,
    slopes: Option<[u32; 2]>,
}

impl Position {
    fn load(e: &mut Editor, inputs: &Inputs, sloped: bool) -> Result<Self> {
        let BuiltIn { variable, member, ty } = inputs.position;
        if e.declared.components(ty) != Some((&Type::Float { width: 32 }, 4)) {
            return Err("gl_FragCoord is of an unknown type".into());
        }
        let float = e.float();
        let at = e.load(class::INPUT, variable, member.as_slice(), ty);
        let z = e.value(op::COMPOSITE_EXTRACT, float, &[at, 2]);
        let slopes = sloped.then(|| [op::D_PDX, op::D_PDY].map(|d| e.value(d, float, &[z])));
        Ok(Self { at, z, slopes })
    }

    /// x and y in 16 bits each.
    fn place(&self, e: &mut Editor) -> u32 {
        let (uint, float, sixteen) = (e.uint(), e.float(), e.constant(16));
        let [x, y] = [0, 1].map(|n| {
            let at = e.value(op::COMPOSITE_EXTRACT, float, &[self.at, n]);
            e.value(op::CONVERT_F_TO_U, uint, &[at])
        });
        let y = e.value(op::SHIFT_LEFT_LOGICAL, uint, &[y, sixteen]);
        e.value(op::BITWISE_OR, uint, &[x, y])
    }

    /// Depth and slopes as bits, or the depth that the shader wrote.
    fn depth(&self, e: &mut Editor, written: Option<BuiltIn>) -> Result<[u32; 3]> {
        let z = match written {
            None => self.z,
            Some(BuiltIn { variable, member, ty }) => {
                if e.declared.ty(ty) != Some(&Type::Float { width: 32 }) {
                    return Err("gl_FragDepth is of an unknown type".into());
                }
                e.load(class::OUTPUT, variable, member.as_slice(), ty)
            }
        };
        let uint = e.uint();
        let zero = e.constant(0);
        let z = e.value(op::BITCAST, uint, &[z]);
        let [dx, dy] = match self.slopes {
            Some(slopes) => slopes.map(|slope| e.value(op::BITCAST, uint, &[slope])),
            None => [zero; 2],
        };
        Ok([z, dx, dy])
    }
}

/// The samples that the fragment covers and the shader lets through.
fn coverage(e: &mut Editor, inputs: &Inputs, written: &Written) -> Result<u32> {
    let (uint, one) = (e.uint(), e.constant(1));
    let mut coverage = e.load_integer(class::INPUT, inputs.mask, "gl_SampleMaskIn")?;
    if let Some(sample) = inputs.sample {
        // The mask has this one sample's bit alone, or should have: drivers have been wrong here.
        let sample = e.load_integer(class::INPUT, sample, "gl_SampleID")?;
        let bit = e.value(op::SHIFT_LEFT_LOGICAL, uint, &[one, sample]);
        coverage = e.value(op::BITWISE_AND, uint, &[coverage, bit]);
    }
    if let Some(mask) = written.mask {
        let mask = e.load_integer(class::OUTPUT, mask, "gl_SampleMask")?;
        coverage = e.value(op::BITWISE_AND, uint, &[coverage, mask]);
    }
    Ok(coverage)
}

/// Whether there is a fragment to be recorded.
///
/// Nothing that helper invocations store, and no count of theirs, reaches memory; but what a count
/// gives back to them is not defined, and those that the shader itself made helpers need not have
/// been what the hardware takes for one. They are asked.
fn counts(e: &mut Editor, coverage: u32, demotes: bool) -> u32 {
    let (bool, zero) = (e.bool(), e.constant(0));
    let covers = e.value(op::I_NOT_EQUAL, bool, &[coverage, zero]);
    if !demotes {
        return covers;
    }
    e.capability(capability::DEMOTE_TO_HELPER_INVOCATION);
    e.extension("SPV_EXT_demote_to_helper_invocation");
    let helper = e.value(op::IS_HELPER_INVOCATION, bool, &[]);
    let real = e.value(op::LOGICAL_NOT, bool, &[helper]);
    e.value(op::LOGICAL_AND, bool, &[covers, real])
}

/// Bit 31 where the front is seen.
fn front(e: &mut Editor, inputs: &Inputs) -> Result<u32> {
    let BuiltIn { variable, member, ty } = inputs.front;
    if e.declared.ty(ty) != Some(&Type::Bool) {
        return Err("gl_FrontFacing is of an unknown type".into());
    }
    let front = e.load(class::INPUT, variable, member.as_slice(), ty);
    let (uint, yes, no) = (e.uint(), e.constant(FRONT), e.constant(0));
    Ok(e.value(op::SELECT, uint, &[front, yes, no]))
}
