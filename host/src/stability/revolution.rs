//! One revolution of a tool with variable pitch, collocated: several delays that end between the nodes.
//!
//! Tooth j at an immersion angle sees p_j = nᵀ u, and the tooth before it saw p_{j−1} at the same angle, one pitch
//! earlier: a number of another element, between its nodes, in this revolution or the one before. It is interpolated by
//! the polynomial through the nodes of that element, for which p must be smooth there. Displacement has a kink of some
//! order wherever a tooth enters or leaves; the surface hands it on to the next tooth, one delay later and smoother by
//! what the structure smooths. So elements end at all of these times, for several generations.
//!
//! The state of the delay equation is x at the start of the revolution, and p of the elements of the revolution before
//! that are still to be cut again.

use nalgebra::DMatrix;

use super::element::{CuttingTooth, Element, Step};
use super::exponential::Exponential;
use super::gauss::Gauss;
use super::passages::{Passages, distinct};
use super::period::{DECAY_MAX, Rates};
use super::pitched::Pitched;

/// How finely a revolution is cut.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Fineness {
    /// The largest angle, rad, by which the fastest motion turns within an element.
    pub(super) angle: f64,
    /// Error of interpolation within an element, relative to the motion at the fastest rate, that is aimed at.
    pub(super) tolerance: f64,
    /// Generations of kinks at which elements end.
    pub(super) generations: u32,
}

impl Fineness {
    /// For answers.
    pub(super) const WORKING: Self = Self {
        angle: 5.0,
        tolerance: 1e-9,
        generations: 3,
    };
    /// What changes from the working one to this is an estimate of the error of the former.
    pub(super) const FINE: Self = Self {
        angle: 4.0,
        tolerance: 1e-11,
        generations: 4,
    };
}

/// No further generation of kinks is added to so many: elements are then short, and kinks of later generations small.
const KINKS_MAX: usize = 300;

/// Number of a passage's values among those of an element: of all nodes, those of one tooth.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Series {
    pub(super) element: usize,
    /// Which of the teeth that cut in that element.
    pub(super) tooth: usize,
}

/// Where the values of the tooth before are found.
#[derive(Clone, Copy, Debug)]
pub(super) enum Source {
    /// In this revolution.
    Own(Series),
    /// In the revolution before: in the state, from this row on.
    Earlier(usize),
}

/// Where the tooth before was when it cut what a port sees now.
#[derive(Clone, Debug)]
pub(super) struct Past {
    pub(super) source: Source,
    /// Lagrange polynomials of the nodes at that time.
    pub(super) weights: Vec<f64>,
}

/// An element and where it stands.
pub(super) struct Piece {
    start_s: f64,
    duration_s: f64,
    pub(super) gauss: &'static Gauss,
    /// Number of the tooth for each port of a node.
    pub(super) teeth: Vec<usize>,
    pub(super) element: Element,
    /// Of each port.
    pub(super) pasts: Vec<Past>,
}

/// One revolution at one speed.
pub(super) struct Revolution<'a> {
    pub(super) pitched: &'a Pitched,
    pub(super) period_s: f64,
    pub(super) pieces: Vec<Piece>,
    /// What of the revolution before acts in this one, with the first row in the state.
    pub(super) kept: Vec<(Series, usize)>,
    pub(super) size: usize,
}

impl<'a> Revolution<'a> {
    /// Cuts the revolution at a speed for depths up to `depth_m`; `None` where a tooth finds no surface before it.
    pub(super) fn new(pitched: &'a Pitched, rpm: f64, depth_m: f64, fineness: Fineness) -> Option<Self> {
        let passages = Passages::new(pitched, rpm);
        // At the unit circle |w (1 − 1/μ)| ≤ 2 w.
        let rate = Rates::new(&pitched.problem).at(2.0 * depth_m);
        let exponential = Exponential::new(&pitched.problem.structure.a);
        let mut pieces = Vec::new();
        for ends in kinks(&passages, fineness.generations).windows(2) {
            cut(
                pitched,
                &passages,
                &exponential,
                (ends[0], ends[1]),
                (rate, fineness),
                &mut pieces,
            );
        }
        let mut revolution = Self {
            pitched,
            period_s: passages.period_s,
            pieces,
            kept: Vec::new(),
            size: pitched.problem.structure.order(),
        };
        revolution.link(&passages)?;
        Some(revolution)
    }

    /// Finds what every port sees of the past.
    fn link(&mut self, passages: &Passages) -> Option<()> {
        let starts_s: Vec<f64> = self.pieces.iter().map(|piece| piece.start_s).collect();
        for index in 0..self.pieces.len() {
            let mut pasts = Vec::with_capacity(self.pieces[index].element.ports.len());
            let per_node = self.pieces[index].teeth.len();
            for port in 0..self.pieces[index].element.ports.len() {
                let tooth = self.pieces[index].teeth[port % per_node];
                let passage = passages.list.iter().find(|passage| passage.tooth == tooth)?;
                let then_s = self.pieces[index].element.ports[port].time_s - passage.delay_s;
                let is_earlier = then_s < 0.0;
                let then_s = if is_earlier {
                    then_s + self.period_s
                } else {
                    then_s
                };
                let element = starts_s
                    .partition_point(|&start_s| start_s <= then_s)
                    .saturating_sub(1);
                let piece = &self.pieces[element];
                let tooth = piece.teeth.iter().position(|&tooth| tooth == passage.before)?;
                let series = Series { element, tooth };
                let weights = lagrange(&piece.gauss.nodes, (then_s - piece.start_s) / piece.duration_s);
                let source = if is_earlier {
                    Source::Earlier(self.keep(series))
                } else {
                    Source::Own(series)
                };
                pasts.push(Past { source, weights });
            }
            self.pieces[index].pasts = pasts;
        }
        Some(())
    }

    /// The first row of a series in the state, which gets it if need be.
    fn keep(&mut self, series: Series) -> usize {
        if let Some((_, first)) = self.kept.iter().find(|(known, _)| *known == series) {
            return *first;
        }
        let first = self.size;
        self.kept.push((series, first));
        self.size += self.pieces[series.element].gauss.nodes.len();
        first
    }
}

/// All times at which displacement may have a kink, s, ascending, with both ends of the period.
fn kinks(passages: &Passages, generations: u32) -> Vec<f64> {
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

/// Cuts the time between two kinks into elements.
fn cut(
    pitched: &Pitched,
    passages: &Passages,
    exponential: &Exponential,
    (from_s, to_s): (f64, f64),
    (rate, fineness): (f64, Fineness),
    pieces: &mut Vec<Piece>,
) {
    let problem = &pitched.problem;
    let length_s = to_s - from_s;
    let cutting: Vec<_> = passages.cutting_at(0.5 * (from_s + to_s)).collect();
    if cutting.is_empty() {
        let order = problem.structure.order();
        pieces.push(Piece {
            start_s: from_s,
            duration_s: length_s,
            gauss: Gauss::shared(1),
            teeth: Vec::new(),
            element: Element {
                flow: exponential.at(length_s),
                observe: DMatrix::zeros(0, order),
                kernel: DMatrix::zeros(0, 0),
                drive: DMatrix::zeros(order, 0),
                ports: Vec::new(),
                axial: None,
            },
            pasts: Vec::new(),
        });
        return;
    }
    let start = problem.process.engagement.start;
    let teeth: Vec<CuttingTooth> = cutting
        .iter()
        .map(|passage| CuttingTooth {
            immersion: start - passage.entry_s * passages.rad_per_s,
            feed_m: passage.feed_m,
        })
        .collect();
    // The coefficients turn as products of two sines: twice the angle of the tool.
    let angle = (rate + 2.0 * passages.rad_per_s) * length_s;
    let decay = problem.fastest_decay() * length_s;
    let count = (angle / fineness.angle).max(decay / DECAY_MAX).ceil().max(1.0);
    let gauss = Gauss::shared(nodes_for(angle / count, fineness.tolerance));
    let duration_s = length_s / count;
    let step = Step::new(problem, exponential, gauss, duration_s);
    // The count is small: a few elements for each vibration in the revolution.
    for index in 0..count as usize {
        let start_s = from_s + duration_s * index as f64;
        let (phase, turn) = (start_s * passages.rad_per_s, duration_s * passages.rad_per_s);
        pieces.push(Piece {
            start_s,
            duration_s,
            gauss,
            teeth: cutting.iter().map(|passage| passage.tooth).collect(),
            element: step.element_of(problem, &teeth, phase, turn),
            pasts: Vec::new(),
        });
    }
}

/// The fewest Gauss nodes, from 4 to 40, through which e^{iz} over an angle z is interpolated to a tolerance:
/// z^m/m! times the largest value of the monic Legendre polynomial on [0, 1], (m!)²/(2m)!.
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

/// The Lagrange polynomials of nodes at a place.
fn lagrange(nodes: &[f64], place: f64) -> Vec<f64> {
    let weight = |i: usize| -> f64 {
        let others = nodes.iter().enumerate().filter(|(j, _)| *j != i);
        others
            .map(|(_, node)| (place - node) / (nodes[i] - node))
            .product()
    };
    (0..nodes.len()).map(weight).collect()
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use num_complex::Complex64;

    use super::*;

    #[test]
    fn interpolation_errs_by_no_more_than_is_aimed_at() {
        for (angle, tolerance) in [(0.3, 1e-9), (2.0, 1e-9), (5.0, 1e-9), (4.0, 1e-11), (TAU, 1e-6)] {
            let gauss = Gauss::shared(nodes_for(angle, tolerance));
            let worst = (0..=200).map(|i| {
                let place = f64::from(i) / 200.0;
                let weights = lagrange(&gauss.nodes, place);
                let value: Complex64 = weights
                    .iter()
                    .zip(&gauss.nodes)
                    .map(|(weight, node)| Complex64::cis(angle * node) * *weight)
                    .sum();
                (value - Complex64::cis(angle * place)).norm()
            });
            let worst = worst.fold(0.0, f64::max);
            // Of the remainder both parts of e^{iz} have their share.
            assert!(worst < 2.0_f64.sqrt() * tolerance, "{angle} {tolerance}: {worst}");
        }
    }
}
