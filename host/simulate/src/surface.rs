//! The surface that a tooth leaves: what the next one has in front of it.

use std::collections::VecDeque;

use quietcut_model::cutter::{Cutter, Immersion, Tooth};
use quietcut_numerics::dormand_prince::{Quartic, at};

/// Places, as fractions of a piece, at which a surface that was left standing is taken over.
pub(super) const TAKEN_AT: [f64; 6] = [0.0, 0.2, 0.4, 0.6, 0.8, 1.0];

/// What one tooth left behind over the last pass or so, by the time at which it passed.
///
/// Heights are measured as [`Cutter::reach_m`] measures, in the frame that feeds with the tool.
#[derive(Clone, Debug, Default)]
pub(super) struct Surface {
    pieces: VecDeque<Piece>,
}

#[derive(Clone, Copy, Debug)]
struct Piece {
    from_s: f64,
    to_s: f64,
    shape: Shape,
}

#[derive(Clone, Copy, Debug)]
enum Shape {
    /// The tooth cut it: it lies where the edge was.
    Cut([Quartic; 3]),
    /// The edge did not reach it, it was left by an earlier tooth: Newton's divided differences on [`TAKEN_AT`].
    Left([f64; 6]),
}

impl Surface {
    /// The tooth was at the surface from `from_s` to `to_s` while the tool moved along `displacement`.
    pub(super) fn push_cut(&mut self, from_s: f64, to_s: f64, displacement: [Quartic; 3]) {
        self.pieces.push_back(Piece {
            from_s,
            to_s,
            shape: Shape::Cut(displacement),
        });
    }

    /// The tooth was off the surface from `from_s` to `to_s`; `heights` are those of the surface at [`TAKEN_AT`].
    pub(super) fn push_left(&mut self, from_s: f64, to_s: f64, mut heights: [f64; 6]) {
        for order in 1..heights.len() {
            for i in (order..heights.len()).rev() {
                heights[i] = (heights[i] - heights[i - 1]) / (TAKEN_AT[i] - TAKEN_AT[i - order]);
            }
        }
        self.pieces.push_back(Piece {
            from_s,
            to_s,
            shape: Shape::Left(heights),
        });
    }

    /// Forgets what was left before `t`.
    pub(super) fn forget_before(&mut self, t: f64) {
        while self.pieces.front().is_some_and(|piece| piece.to_s < t) {
            self.pieces.pop_front();
        }
    }

    /// Height of the surface that `tooth` left at `t`, m; before the first record the tool was at rest.
    ///
    /// `within` are the ends of the stretch that the caller looks at: where two pieces meet at one of its ends,
    /// the piece inside the stretch counts.
    pub(super) fn height_m(
        &self,
        cutter: &Cutter,
        tooth: &Tooth,
        place: Immersion,
        t: f64,
        within: [f64; 2],
    ) -> f64 {
        let key = t.clamp(within[0], within[1]);
        let index = self.pieces.partition_point(|piece| piece.to_s <= key);
        let piece = match self.pieces.get(index).or(self.pieces.back()) {
            // The first record begins with a step, so a time before it is before the start.
            Some(piece) if index > 0 || piece.from_s <= key => piece,
            _ => return cutter.reach_m(tooth, place, [0.0; 3]),
        };
        let u = ((t - piece.from_s) / (piece.to_s - piece.from_s)).clamp(0.0, 1.0);
        match &piece.shape {
            Shape::Cut(displacement) => {
                let x = std::array::from_fn(|axis| at(&displacement[axis], u));
                cutter.reach_m(tooth, place, x)
            }
            Shape::Left(differences) => differences
                .iter()
                .zip(TAKEN_AT)
                .rev()
                .fold(0.0, |height, (difference, node)| height * (u - node) + difference),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::slot_cutter;

    #[test]
    fn a_surface_left_standing_is_kept_to_the_fifth_degree() {
        let polynomial = |t: f64| 1.0 + t - 2.0 * t.powi(2) + 0.5 * t.powi(3) - t.powi(4) + 3.0 * t.powi(5);
        let mut surface = Surface::default();
        let (from, to) = (2.0, 2.5);
        surface.push_left(from, to, TAKEN_AT.map(|u| polynomial(from + u * (to - from))));
        let cutter = slot_cutter();
        for i in 0..=10 {
            let t = from + f64::from(i) * 0.05;
            let height = surface.height_m(&cutter, &cutter.teeth[0], cutter.immersion(1.0), t, [from, to]);
            // Rounding of six differences of numbers up to 300.
            assert!((height - polynomial(t)).abs() < 1e-11, "{t}: {height}");
        }
    }
}
