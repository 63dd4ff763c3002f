//! What a fragment shader writes at one location.

use super::Output;
use super::declared::Type;
use super::editor::Editor;
use super::locations::Locations;
use super::module::Result;
use super::spec::{class, decoration, op};

/// A part of an output variable that lies at the location.
#[derive(Clone, Debug)]
struct Part {
    variable: u32,
    /// Where in it.
    indices: Vec<u32>,
    ty: u32,
    /// First component of the location, and how many follow.
    component: u32,
    n: u32,
}

/// The colour that a fragment shader writes.
pub(super) struct Colour {
    parts: Vec<Part>,
    pub(super) output: Output,
}

impl Colour {
    /// What lies at a location: often one variable, but several may share its components.
    pub(super) fn find(e: &Editor, location: u32) -> Result<Self> {
        let declared = &e.declared;
        let locations = Locations::new(declared);
        let mut colour = Self { parts: Vec::new(), output: Output::None };
        let mut taken = [false; 4];
        let mut unknown = None;
        for id in &e.entry.interface {
            let Some(variable) = declared.variables.get(id).filter(|v| v.class == class::OUTPUT)
            else {
                continue;
            };
            let decorated = |d| declared.decoration(*id, d);
            // The second colour for blending (dual source) has the first one's location.
            if decorated(decoration::INDEX).is_some_and(|index| index != 0) {
                continue;
            }
            let Some(first) = decorated(decoration::LOCATION) else {
                continue;
            };
            let (indices, ty) = match locations.part(variable.to, first, location) {
                Ok(Some(part)) => part,
                Ok(None) => continue,
                Err(reason) => {
                    unknown = Some(reason);
                    continue;
                }
            };
            let strange = || format!("the output at location {location} is of an unknown type");
            let (of, n) = declared.components(ty).ok_or_else(strange)?;
            let component = decorated(decoration::COMPONENT).unwrap_or(0);
            let last = component.checked_add(n).filter(|last| *last <= 4).ok_or_else(strange)?;
            let places = &mut taken[component as usize..last as usize];
            if places.contains(&true) {
                return Err(format!("several outputs overlap at location {location}"));
            }
            places.fill(true);
            colour.output = match (of, colour.output) {
                (Type::Float { width: 32 }, Output::None) => Output::Float(last),
                (Type::Float { width: 32 }, Output::Float(n)) => Output::Float(n.max(last)),
                (Type::Float { width: 16 }, Output::None) => Output::Half(last),
                (Type::Float { width: 16 }, Output::Half(n)) => Output::Half(n.max(last)),
                (Type::Int { .. }, Output::None | Output::Integer) => Output::Integer,
                _ => return Err(strange()),
            };
            colour.parts.push(Part { variable: *id, indices, ty, component, n });
        }
        // What may or may not reach as far does not where another lies.
        match unknown {
            Some(reason) if colour.parts.is_empty() => Err(reason),
            _ => Ok(colour),
        }
    }

    /// Loads the four components; what is not written is 0, and alpha 1.
    pub(super) fn load(&self, e: &mut Editor) -> [u32; 4] {
        let (zero, one) = (e.float_constant(0.0), e.float_constant(1.0));
        let mut rgba = [zero, zero, zero, one];
        if self.output == Output::Integer {
            return rgba;
        }
        let float = e.float();
        for part in &self.parts {
            let mut value = e.load(class::OUTPUT, part.variable, &part.indices, part.ty);
            if matches!(self.output, Output::Half(_)) {
                let wide = if part.n == 1 { float } else { e.vector(float, part.n) };
                value = e.value(op::F_CONVERT, wide, &[value]);
            }
            for n in 0..part.n {
                rgba[(part.component + n) as usize] = match part.n {
                    1 => value,
                    _ => e.value(op::COMPOSITE_EXTRACT, float, &[value, n]),
                };
            }
        }
        rgba
    }
}
