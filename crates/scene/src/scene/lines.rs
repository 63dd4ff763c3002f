//! Lines of files that do not say how wide they are: curves, drawn as ribbons.

use std::collections::HashMap;

use glam::{DVec3, Vec3, Vec4};

use crate::scene::{Object, Scene, Shape, Strands};
use screendoor_trace::error::{Error, Result};

/// How wide lines are where nobody says it, as a share of the diagonal of the box that holds
/// all of them.
pub(super) const SHARE: f32 = 0.0024;

impl Strands {
    /// Adds a curve through these points, which has no width yet; of fewer than two points
    /// nothing is added. Colours are there for all points or for none.
    pub(super) fn add_line(&mut self, points: &[Vec3], colours: &[Vec4]) {
        if points.len() < 2 {
            return;
        }
        if self.starts.is_empty() {
            self.starts.push(0);
        }
        self.points.extend(points);
        self.colours.extend(colours);
        self.starts.push(self.points.len() as u32);
    }

    /// Whether these are lines that have no width yet.
    fn lack_width(&self) -> bool {
        self.radii.is_empty() && !self.points.is_empty()
    }
}

/// The lines of a shape, where it is made of lines that have no width yet.
fn lines_of(shape: &Shape) -> Option<&Strands> {
    match shape {
        Shape::Strands(strands) if strands.lack_width() => Some(strands),
        _ => None,
    }
}

impl Scene {
    /// The lines of an object, where it is made of lines that have no width yet.
    fn lines(&self, object: &Object) -> Option<&Strands> {
        lines_of(&self.shapes[object.shape])
    }

    /// Gives lines their width in the scene's units, or where none is given a share of their
    /// extent. Lines beside surfaces are edges as a rule, and drawn only where a width is given.
    ///
    /// # Errors
    /// [`Error::Config`] for a width that none can have, or where there are no lines;
    /// [`Error::Invalid`] where there is nothing but lines of no extent.
    pub(super) fn widen_lines(&mut self, width: Option<f64>) -> Result<()> {
        if let Some(width) = width.filter(|width| !(width.is_finite() && *width > 0.0)) {
            let what = format_args!("lines cannot be {width} wide");
            return Err(Error::config(what, "give a width above 0, in the scene's units"));
        }
        let all: Vec<&Strands> = self.objects.iter().filter_map(|o| self.lines(o)).collect();
        let (objects, count) = (all.len(), all.iter().map(|l| l.segment_count()).sum::<usize>());
        let source = self.source.clone();
        let width = match width {
            Some(_) if count == 0 => {
                let what = format_args!("'{source}' has no lines");
                return Err(Error::config(what, "leave the line width out"));
            }
            Some(width) => width,
            None if count == 0 => return Ok(()),
            None if objects < self.objects.len() => {
                self.warnings.push(format!(
                    "{source}: {count} lines beside surfaces are not drawn; a line width draws them"
                ));
                self.leave_lines_out();
                return Ok(());
            }
            None => {
                let width = f64::from(SHARE) * self.extent_of_lines();
                if !(width.is_finite() && width > 0.0) {
                    return Err(Error::invalid(
                        &source,
                        "there is nothing in it but lines of no extent",
                        "export it again",
                    ));
                }
                self.warnings.push(format!(
                    "{source}: it does not say how wide its {count} lines are, which are taken \
                     for {SHARE} of their extent; a line width says it"
                ));
                width
            }
        };
        self.give_lines(width);
        Ok(())
    }

    /// The diagonal of the box that holds all lines.
    fn extent_of_lines(&self) -> f64 {
        let (mut low, mut high) = (DVec3::MAX, DVec3::MIN);
        for object in &self.objects {
            for point in self.lines(object).map_or(&[][..], |lines| &lines.points) {
                let at = object.place.transform_point3(point.as_dvec3());
                (low, high) = (low.min(at), high.max(at));
            }
        }
        (high - low).length()
    }

    /// Takes lines out of the scene, objects and shapes.
    fn leave_lines_out(&mut self) {
        let kept: Vec<bool> = self.objects.iter().map(|o| self.lines(o).is_none()).collect();
        let mut kept = kept.into_iter();
        self.objects.retain(|_| kept.next().unwrap_or(true));
        let mut next = 0;
        let numbers: Vec<usize> = self
            .shapes
            .iter()
            .map(|shape| {
                let number = next;
                next += usize::from(lines_of(shape).is_none());
                number
            })
            .collect();
        self.shapes.retain(|shape| lines_of(shape).is_none());
        self.objects.iter_mut().for_each(|object| object.shape = numbers[object.shape]);
    }

    /// Gives lines this width. A ribbon grows with its object, so that a shape that stands in
    /// places of several sizes becomes several.
    fn give_lines(&mut self, width: f64) {
        let mut widened: HashMap<(usize, u64), usize> = HashMap::new();
        let mut flat = 0;
        for i in 0..self.objects.len() {
            let object = &self.objects[i];
            let Some(lines) = self.lines(object) else { continue };
            let scale = object.place.matrix3.determinant().abs().cbrt();
            let place = (object.shape, scale.to_bits());
            let radius = (width / 2.0 / scale) as f32;
            // In a place that is squashed flat there is no such width.
            let drawn = radius.is_finite() && radius > 0.0;
            flat += usize::from(!drawn) * lines.segment_count();
            let made = match widened.get(&place) {
                Some(made) => *made,
                None => {
                    let radii = vec![if drawn { radius } else { 0.0 }; lines.points.len()];
                    let strands = Strands { radii, ..lines.clone() };
                    self.shapes.push(Shape::Strands(strands));
                    self.shapes.len() - 1
                }
            };
            widened.insert(place, made);
            self.objects[i].shape = made;
        }
        if flat > 0 {
            let source = &self.source;
            self.warnings.push(format!(
                "{source}: {flat} lines are not drawn, in places that are squashed flat"
            ));
        }
        self.leave_lines_out();
    }
}
