//! Mesh of one revolution with several delays, and the location of the previously cut surface for every chip.
//!
//! Tooth j at an immersion angle observes p_j = nᵀ u; the preceding tooth, j + 1, observed p_{j+1} at the same
//! angle, one pitch earlier. That displacement lies in another subinterval, between its nodes, of this revolution
//! or the preceding one. It is interpolated by the polynomial through the nodes of that subinterval, which requires
//! p to be smooth there. The displacement has a kink (a jump in some derivative) wherever a tooth enters or leaves.
//! The cut surface carries the kink to the next tooth one delay later, where the structure smooths it. Subintervals
//! therefore end at the entries and exits (generation 0), one delay after them (generation 1), and so on for
//! several generations.

use super::period::{DECAY_MAX, Rates};
use super::pitched::Pitched;
use super::tooth_passages::{ToothPassage, ToothPassages, distinct};
use crate::criteria::KINKS_MAX;
use quietcut_numerics::quadrature::Gauss;

/// Subinterval length, tolerance and number of kink generations of the mesh over a revolution.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Fineness {
    /// Largest phase angle, rad, by which the fastest motion may rotate over one subinterval.
    pub(crate) angle: f64,
    /// Target for the interpolation error within a subinterval, relative to the motion at the fastest rate.
    pub(crate) tolerance: f64,
    /// Number of generations of displacement kinks (at entries and exits, one delay later, and so on) at which
    /// subintervals end.
    pub(crate) generations: u32,
}

impl Fineness {
    /// Working mesh of the revolution, on which Floquet multipliers and limits are computed.
    pub(crate) const WORKING: Self = Self {
        angle: 5.0,
        tolerance: 1e-9,
        generations: 3,
    };
    /// Finer mesh of the revolution: the change of a result from the working mesh to this one estimates the error of
    /// the working mesh.
    pub(crate) const FINE: Self = Self {
        angle: 4.0,
        tolerance: 1e-11,
        generations: 4,
    };
}

/// Subdivision of the times at which no tooth cuts (free flight).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Flight {
    /// Between two kinks of the displacement, free flight is one subinterval; its nodes are not used, since the free
    /// motion is known in closed form.
    Whole,
    /// Free flight is divided as finely as the cutting times.
    Cut,
}

/// Displacements p along the chip normal of one tooth at all nodes of one subinterval.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Series {
    /// Index of the subinterval in the mesh of the revolution.
    pub(crate) subinterval: usize,
    /// Index of the tooth among those that cut in its subinterval.
    pub(crate) tooth: usize,
}

/// Location of the delayed displacements p_τ that the preceding tooth left on the surface.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Source {
    /// The preceding tooth cut this surface in a subinterval of the present revolution.
    Own(Series),
    /// The preceding tooth cut this surface in the preceding revolution: its displacements are in the state vector of
    /// the map, from this row on.
    Earlier(usize),
}

/// Delayed displacement at one port: weighted sum over the nodes of the subinterval in which the preceding tooth cut
/// the surface.
#[derive(Clone, Debug)]
pub(crate) struct DelayedDisplacement {
    pub(crate) source: Source,
    /// Weights of the nodes at which the preceding tooth cut the surface: their Lagrange polynomials at the delayed
    /// time.
    pub(crate) weights: Vec<f64>,
}

/// Subinterval of the revolution in which the displacement is smooth.
#[derive(Clone, Debug)]
pub(crate) struct Subinterval {
    /// Start of the subinterval, s.
    pub(crate) start_s: f64,
    /// Duration of the subinterval, s.
    pub(crate) duration_s: f64,
    pub(crate) gauss: &'static Gauss,
    /// Passages of the teeth that cut in this subinterval, in the order of the ports of a node.
    pub(crate) cutting: Vec<ToothPassage>,
    /// Delayed displacement at each port (cutting tooth at a node), node by node.
    pub(crate) pasts: Vec<DelayedDisplacement>,
}

/// Mesh of one revolution at one spindle speed.
#[derive(Clone, Debug)]
pub(crate) struct RevolutionMesh {
    pub(crate) passages: ToothPassages,
    pub(crate) subintervals: Vec<Subinterval>,
    /// Displacements of the preceding revolution that act in the present one, each with its first row in the state
    /// vector of the map.
    pub(crate) kept: Vec<(Series, usize)>,
    /// Number of rows of the map's state vector: the states of the structure, then the `kept` displacements.
    pub(crate) size: usize,
}

impl RevolutionMesh {
    /// Divides the revolution at a spindle speed, for depths up to `depth_m`; `None` if no preceding tooth has cut the
    /// surface in front of some tooth.
    pub(crate) fn new(
        pitched: &Pitched,
        rpm: f64,
        depth_m: f64,
        fineness: Fineness,
        flight: Flight,
    ) -> Option<Self> {
        let passages = ToothPassages::new(pitched, rpm);
        // The mesh resolves complex depths up to 2 w, since |w (1 − 1/μ)| ≤ 2 w on the unit circle. Directional
        // coefficients oscillate at twice the rotation of the tool.
        let rate = Rates::new(&pitched.problem).at(2.0 * depth_m) + 2.0 * passages.rad_per_s;
        let decay = pitched.problem.fastest_decay();
        let mut subintervals = Vec::new();
        for ends in kinks(&passages, fineness.generations).windows(2) {
            let length_s = ends[1] - ends[0];
            let cutting: Vec<ToothPassage> =
                passages.cutting_at(0.5 * (ends[0] + ends[1])).copied().collect();
            let angle = rate * length_s;
            let (count, nodes) = if cutting.is_empty() && flight == Flight::Whole {
                (1.0, 1)
            } else {
                let count = (angle / fineness.angle)
                    .max(decay * length_s / DECAY_MAX)
                    .ceil()
                    .max(1.0);
                (count, nodes_for(angle / count, fineness.tolerance))
            };
            let duration_s = length_s / count;
            // The conversion to an integer is exact: the count is a few subintervals for each vibration in the
            // revolution.
            subintervals.extend((0..count as usize).map(|index| Subinterval {
                start_s: ends[0] + duration_s * index as f64,
                duration_s,
                gauss: Gauss::shared(nodes),
                cutting: cutting.clone(),
                pasts: Vec::new(),
            }));
        }
        let mut mesh = Self {
            passages,
            subintervals,
            kept: Vec::new(),
            size: pitched.problem.structure.order(),
        };
        mesh.link()?;
        Some(mesh)
    }

    /// Finds the delayed displacement of every port (cutting tooth at a node); `None` if the preceding tooth did not
    /// cut at the delayed time.
    fn link(&mut self) -> Option<()> {
        let period_s = self.passages.period_s;
        let starts_s: Vec<f64> = self
            .subintervals
            .iter()
            .map(|subinterval| subinterval.start_s)
            .collect();
        for index in 0..self.subintervals.len() {
            let here = self.subintervals[index].clone();
            let mut pasts = Vec::with_capacity(here.gauss.nodes.len() * here.cutting.len());
            for node in &here.gauss.nodes {
                for passage in &here.cutting {
                    let then_s = here.start_s + here.duration_s * node - passage.delay_s;
                    let is_earlier = then_s < 0.0;
                    let then_s = if is_earlier { then_s + period_s } else { then_s };
                    let subinterval = starts_s
                        .partition_point(|&start_s| start_s <= then_s)
                        .saturating_sub(1);
                    let there = &self.subintervals[subinterval];
                    let mut teeth = there.cutting.iter();
                    let tooth = teeth.position(|other| other.tooth == passage.before)?;
                    let series = Series { subinterval, tooth };
                    let weights = there.gauss.lagrange((then_s - there.start_s) / there.duration_s);
                    let source = if is_earlier {
                        Source::Earlier(self.keep(series))
                    } else {
                        Source::Own(series)
                    };
                    pasts.push(DelayedDisplacement { source, weights });
                }
            }
            self.subintervals[index].pasts = pasts;
        }
        Some(())
    }

    /// First row, in the state vector of the map, of the displacements `series` of the preceding revolution; appends
    /// them if they are missing.
    fn keep(&mut self, series: Series) -> usize {
        if let Some((_, first)) = self.kept.iter().find(|(known, _)| *known == series) {
            return *first;
        }
        let first = self.size;
        self.kept.push((series, first));
        self.size += self.subintervals[series.subinterval].gauss.nodes.len();
        first
    }
}

/// Times at which the displacement may have a kink (at an entry or exit, or up to `generations` delays later), s,
/// ascending, with both ends of the period. A generation with which there would be more than `KINKS_MAX` times is left
/// out, as are all later ones.
fn kinks(passages: &ToothPassages, generations: u32) -> Vec<f64> {
    let mut all = passages.switches_s();
    let mut youngest = all.clone();
    for _ in 0..generations {
        let mut next = Vec::new();
        for &time_s in &youngest {
            for cut in passages.cutting_at(time_s) {
                let after = passages.list.iter().find(|after| after.before == cut.tooth);
                if let Some(after) = after {
                    next.push((time_s + after.delay_s) % passages.period_s);
                }
            }
        }
        let known = all.len();
        let mut grown = all.clone();
        grown.extend(&next);
        let grown = distinct(grown, passages.period_s);
        if grown.len() == known || grown.len() > KINKS_MAX {
            break;
        }
        all = grown;
        youngest = next;
    }
    all
}

/// Fewest Gauss nodes, but at least 4, that interpolate e^{iz} over a phase angle z to a tolerance; 40 if fewer do not
/// reach it. The error is z^m/m! times the maximum (m!)²/(2m)! of the monic Legendre polynomial on [0, 1].
fn nodes_for(angle: f64, tolerance: f64) -> usize {
    let mut error = 1.0;
    for m in 1..=40_u32 {
        let m_f = f64::from(m);
        error *= angle / (2.0 * (2.0 * m_f - 1.0));
        if error < tolerance && m >= 4 {
            return m as usize;
        }
    }
    40
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use num_complex::Complex64;

    use super::*;

    #[test]
    fn interpolation_errs_by_no_more_than_the_tolerance() {
        for (angle, tolerance) in [(0.3, 1e-9), (2.0, 1e-9), (5.0, 1e-9), (4.0, 1e-11), (TAU, 1e-6)] {
            let gauss = Gauss::shared(nodes_for(angle, tolerance));
            let worst = (0..=200).map(|i| {
                let place = f64::from(i) / 200.0;
                let weights = gauss.lagrange(place);
                let value: Complex64 = weights
                    .iter()
                    .zip(&gauss.nodes)
                    .map(|(weight, node)| Complex64::cis(angle * node) * *weight)
                    .sum();
                (value - Complex64::cis(angle * place)).norm()
            });
            let worst = worst.fold(0.0, f64::max);
            // The real and the imaginary part of e^{iz} each have a remainder up to the tolerance, hence √2.
            assert!(worst < 2.0_f64.sqrt() * tolerance, "{angle} {tolerance}: {worst}");
        }
    }
}
