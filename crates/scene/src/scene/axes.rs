//! Which way is up in a file, where its format does not say.

use glam::{DAffine3, DMat3, DVec3};

use crate::scene::Scene;

screendoor_trace::options! {
    /// Which way is up in a scene's file.
    #[derive(Default)]
    pub enum Axes {
        #[default]
        YUp = "y-up": "y points up",
        YDown = "y-down": "y points down, as in trainings of splats: turned by half about z",
        ZUp = "z-up": "z points up, y away from the front",
    }
}

impl Axes {
    /// From the file's space to one with y upwards.
    fn turn(self) -> DMat3 {
        match self {
            Axes::YUp => DMat3::IDENTITY,
            Axes::YDown => DMat3::from_diagonal(DVec3::new(-1.0, -1.0, 1.0)),
            Axes::ZUp => DMat3::from_cols(DVec3::X, -DVec3::Z, DVec3::Y),
        }
    }
}

impl Scene {
    /// Turns what has been read of a file so that y points up.
    pub(super) fn stand_up(&mut self, axes: Axes) {
        if axes == Axes::YUp {
            return;
        }
        let turn = DAffine3::from_mat3(axes.turn());
        self.objects.iter_mut().for_each(|object| object.place = turn * object.place);
        self.world = turn;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_up_comes_up_and_nothing_is_mirrored() {
        let up = [(Axes::YUp, DVec3::Y), (Axes::YDown, -DVec3::Y), (Axes::ZUp, DVec3::Z)];
        for (axes, own) in up {
            assert_eq!(axes.turn() * own, DVec3::Y, "{axes:?}");
            assert_eq!(axes.turn().determinant(), 1.0);
        }
        assert_eq!(Axes::ZUp.turn() * -DVec3::Y, DVec3::Z);
    }
}
