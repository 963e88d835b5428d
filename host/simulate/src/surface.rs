//! The machined surface that a tooth leaves and the next tooth cuts (regeneration).

use std::collections::VecDeque;

use quietcut_model::cutter::{Cutter, Immersion, Tooth};
use quietcut_numerics::dormand_prince::{Quartic, at};

/// Interpolation nodes, as fractions of an integration step, for the surface below a tooth that is out of contact. Six
/// equidistant nodes give a polynomial of degree 5, the order of the integrator.
pub(super) const SURFACE_NODES: [f64; 6] = [0.0, 0.2, 0.4, 0.6, 0.8, 1.0];

/// The machined surface that one tooth left in its engagement arc during at least the last 1.5 longest regenerative
/// delays, as a function of the time at which the tooth passed.
///
/// Heights of the surface, m, are along the chip thickness as in [`Cutter::reach_m`], in the frame that feeds with the
/// tool.
#[derive(Clone, Debug, Default)]
pub(super) struct Surface {
    arcs: VecDeque<SurfaceArc>,
}

/// Piece of the machined surface that a tooth left behind during one integration step, from `from_s` to `to_s`.
#[derive(Clone, Copy, Debug)]
struct SurfaceArc {
    from_s: f64,
    to_s: f64,
    profile: Profile,
}

#[derive(Clone, Copy, Debug)]
/// Height of a piece of the machined surface as a function of the time at which the tooth passed.
enum Profile {
    /// Part of the surface that the tooth cuts: it is the path of the edge, which follows from the displacement of the
    /// tool (dense output, m).
    Cut([Quartic; 3]),
    /// Part of the surface that the edge does not reach: the surface of an earlier tooth passing persists; its heights
    /// as Newton's divided differences at [`SURFACE_NODES`].
    Uncut([f64; 6]),
}

impl Surface {
    /// Appends the piece of surface that the tooth cuts from `from_s` to `to_s`, s, while the tool moves along
    /// `displacement`.
    pub(super) fn push_cut(&mut self, from_s: f64, to_s: f64, displacement: [Quartic; 3]) {
        self.arcs.push_back(SurfaceArc {
            from_s,
            to_s,
            profile: Profile::Cut(displacement),
        });
    }

    /// Appends the piece of surface that the tooth does not reach from `from_s` to `to_s`, s; `heights`, m, are at
    /// [`SURFACE_NODES`].
    pub(super) fn push_uncut(&mut self, from_s: f64, to_s: f64, mut heights: [f64; 6]) {
        for order in 1..heights.len() {
            for i in (order..heights.len()).rev() {
                heights[i] = (heights[i] - heights[i - 1]) / (SURFACE_NODES[i] - SURFACE_NODES[i - order]);
            }
        }
        self.arcs.push_back(SurfaceArc {
            from_s,
            to_s,
            profile: Profile::Uncut(heights),
        });
    }

    /// Removes the pieces of surface that end before the time `t`, s.
    pub(super) fn forget_before(&mut self, t: f64) {
        while self.arcs.front().is_some_and(|arc| arc.to_s < t) {
            self.arcs.pop_front();
        }
    }

    /// Height of the surface that `tooth` left at the time `t`, m. Before the first recorded piece the tool was at
    /// rest.
    ///
    /// `within` are start and end of the evaluated step, s, each minus the regenerative delay. Where two pieces meet at
    /// one of these times, the piece inside the step is used.
    pub(super) fn height_m(
        &self,
        cutter: &Cutter,
        tooth: &Tooth,
        immersion: Immersion,
        t: f64,
        within: [f64; 2],
    ) -> f64 {
        let key = t.clamp(within[0], within[1]);
        let index = self.arcs.partition_point(|arc| arc.to_s <= key);
        let arc = match self.arcs.get(index).or(self.arcs.back()) {
            // Before the first recorded piece, the surface is that of a tool with zero displacement.
            Some(arc) if index > 0 || arc.from_s <= key => arc,
            _ => return cutter.reach_m(tooth, immersion, [0.0; 3]),
        };
        let u = ((t - arc.from_s) / (arc.to_s - arc.from_s)).clamp(0.0, 1.0);
        match &arc.profile {
            Profile::Cut(displacement) => {
                let x = std::array::from_fn(|axis| at(&displacement[axis], u));
                cutter.reach_m(tooth, immersion, x)
            }
            Profile::Uncut(differences) => differences
                .iter()
                .zip(SURFACE_NODES)
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
    fn an_uncut_surface_of_degree_five_is_interpolated_exactly() {
        let polynomial = |t: f64| 1.0 + t - 2.0 * t.powi(2) + 0.5 * t.powi(3) - t.powi(4) + 3.0 * t.powi(5);
        let mut surface = Surface::default();
        let (from, to) = (2.0, 2.5);
        surface.push_uncut(
            from,
            to,
            SURFACE_NODES.map(|u| polynomial(from + u * (to - from))),
        );
        let cutter = slot_cutter();
        for i in 0..=10 {
            let t = from + f64::from(i) * 0.05;
            let height = surface.height_m(&cutter, &cutter.teeth[0], cutter.immersion(1.0), t, [from, to]);
            // Rounding error of six divided differences of numbers up to 300.
            assert!((height - polynomial(t)).abs() < 1e-11, "{t}: {height}");
        }
    }
}
