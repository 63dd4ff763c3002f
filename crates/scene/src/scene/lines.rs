//! Lines of files that do not say how wide they are: curves, drawn as ribbons.

use glam::{Vec3, Vec4};

use crate::scene::{Object, Scene, Shape, Strands};
use screendoor_trace::error::{Error, Result};

/// How wide lines are where nobody says it, as a share of the diagonal of the box that holds
/// their shape.
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

    /// Whether its curves have no width yet.
    fn are_lines(&self) -> bool {
        self.radii.is_empty() && !self.points.is_empty()
    }

    /// A share of the diagonal of the box that holds it.
    fn usual_width(&self) -> f32 {
        let low = self.points.iter().copied().fold(Vec3::MAX, Vec3::min);
        let high = self.points.iter().copied().fold(Vec3::MIN, Vec3::max);
        SHARE * (high - low).length()
    }
}

impl Scene {
    /// Gives lines their width in the scene's units, or where none is given a share of their
    /// extent. Lines beside surfaces are edges as a rule, and drawn only where a width is given.
    ///
    /// # Errors
    /// [`Error::Config`] for a width that none can have, or where there are no lines.
    pub(super) fn widen_lines(&mut self, width: Option<f64>) -> Result<()> {
        let lines = |scene: &Scene, object: &Object| match &scene.shapes[object.shape] {
            Shape::Strands(strands) if strands.are_lines() => strands.segment_count(),
            _ => 0,
        };
        let count: usize = self.objects.iter().map(|object| lines(self, object)).sum();
        let Some(width) = width else {
            let others = self.objects.iter().any(|object| lines(self, object) == 0);
            if count > 0 && others {
                let objects = std::mem::take(&mut self.objects);
                self.objects = objects.into_iter().filter(|o| lines(self, o) == 0).collect();
                let source = &self.source;
                self.warnings.push(format!(
                    "{source}: {count} lines beside surfaces are not drawn; a line width draws them"
                ));
            } else if count > 0 {
                let source = &self.source;
                self.warnings.push(format!(
                    "{source}: it does not say how wide its {count} lines are, which are taken \
                     for {SHARE} of their extent; a line width says it"
                ));
            }
            for shape in &mut self.shapes {
                if let Shape::Strands(strands) = shape
                    && strands.are_lines()
                {
                    strands.radii = vec![strands.usual_width() / 2.0; strands.points.len()];
                }
            }
            return Ok(());
        };
        if !(width.is_finite() && width > 0.0) {
            let what = format_args!("lines cannot be {width} wide");
            return Err(Error::config(what, "give a width above 0, in the scene's units"));
        }
        if count == 0 {
            let what = format_args!("'{}' has no lines", self.source);
            return Err(Error::config(what, "leave the line width out"));
        }
        // A shape may stand in several places, each of its own size.
        let places: Vec<(usize, f64)> = self
            .objects
            .iter()
            .map(|o| (o.shape, o.place.matrix3.determinant().abs().cbrt()))
            .collect();
        for (i, shape) in self.shapes.iter_mut().enumerate() {
            let Shape::Strands(strands) = shape else { continue };
            if !strands.are_lines() {
                continue;
            }
            let scale = places.iter().find(|(shape, _)| *shape == i).map_or(1.0, |(_, s)| *s);
            let radius = (width / 2.0 / scale) as f32;
            strands.radii = vec![radius; strands.points.len()];
        }
        Ok(())
    }
}
