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

use std::rc::Rc;

use nalgebra::{DMatrix, DVector, Dyn, LU, Vector3};
use num_complex::Complex64;

use super::element::{CuttingTooth, Element, Step};
use super::exponential::Exponential;
use super::gauss::Gauss;
use super::krylov::LinearMap;
use super::multiplier::loudest_hz;
use super::one_period::PeriodMap;
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
struct Series {
    element: usize,
    /// Which of the teeth that cut in that element.
    tooth: usize,
}

/// Where the values of the tooth before are found.
#[derive(Clone, Copy, Debug)]
enum Source {
    /// In this revolution.
    Own(Series),
    /// In the revolution before: in the state, from this row on.
    Earlier(usize),
}

/// Where the tooth before was when it cut what a port sees now.
#[derive(Clone, Debug)]
struct Past {
    source: Source,
    /// Lagrange polynomials of the nodes at that time.
    weights: Vec<f64>,
}

/// An element and where it stands.
struct Piece {
    start_s: f64,
    duration_s: f64,
    gauss: &'static Gauss,
    /// Number of the tooth for each port of a node.
    teeth: Vec<usize>,
    element: Element,
    /// Of each port.
    pasts: Vec<Past>,
}

/// One revolution at one speed.
pub(super) struct Revolution<'a> {
    pitched: &'a Pitched,
    period_s: f64,
    pieces: Vec<Piece>,
    /// What of the revolution before acts in this one, with the first row in the state.
    kept: Vec<(Series, usize)>,
    size: usize,
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

    /// The map at a depth, m; `None` where the collocation equations are singular.
    pub(super) fn map(self: Rc<Self>, depth_m: f64) -> Option<RevolutionMap<'a>> {
        let factors = self.pieces.iter().map(|piece| {
            let size = piece.element.kernel.nrows();
            let implicit = DMatrix::identity(size, size) - &piece.element.kernel * depth_m;
            let factor = implicit.lu();
            factor.is_invertible().then_some(factor)
        });
        let factors = factors.collect::<Option<_>>()?;
        Some(RevolutionMap {
            revolution: self,
            depth_m,
            factors,
        })
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

/// The map of a revolution at one depth.
pub(super) struct RevolutionMap<'a> {
    revolution: Rc<Revolution<'a>>,
    depth_m: f64,
    /// I − w Q of each element.
    factors: Vec<LU<f64, Dyn, Dyn>>,
}

/// A revolution of several columns at once.
struct Trace {
    /// x at the end, n × columns.
    state: DMatrix<f64>,
    /// p of each element, columns × ports.
    seen: Vec<DMatrix<f64>>,
    /// p − p_τ of each element, ports × columns.
    chips: Vec<DMatrix<f64>>,
}

impl RevolutionMap<'_> {
    fn trace(&self, columns: &DMatrix<f64>) -> Option<Trace> {
        let revolution = self.revolution.as_ref();
        let order = revolution.pitched.problem.structure.order();
        let width = columns.ncols();
        let mut trace = Trace {
            state: columns.rows(0, order).into_owned(),
            seen: Vec::with_capacity(revolution.pieces.len()),
            chips: Vec::with_capacity(revolution.pieces.len()),
        };
        let before = columns.transpose();
        for (piece, factor) in revolution.pieces.iter().zip(&self.factors) {
            let ports = piece.pasts.len();
            let mut past = DMatrix::zeros(width, ports);
            for (port, of) in piece.pasts.iter().enumerate() {
                let mut sum = past.column_mut(port);
                for (node, weight) in of.weights.iter().enumerate() {
                    let seen = match of.source {
                        Source::Earlier(first) => before.column(first + node),
                        Source::Own(Series { element, tooth }) => {
                            // A delay shorter than an element would end in the element itself.
                            let values = trace.seen.get(element)?;
                            values.column(node * revolution.pieces[element].teeth.len() + tooth)
                        }
                    };
                    sum.axpy(*weight, &seen, 1.0);
                }
            }
            // p − w Q p = E x − w Q p_τ
            let past = past.transpose();
            let mut seen = &piece.element.observe * &trace.state;
            seen.gemm(-self.depth_m, &piece.element.kernel, &past, 1.0);
            if ports > 0 && !factor.solve_mut(&mut seen) {
                return None;
            }
            let chips = &seen - past;
            let mut next = &piece.element.flow * &trace.state;
            next.gemm(self.depth_m, &piece.element.drive, &chips, 1.0);
            trace.state = next;
            trace.seen.push(seen.transpose());
            trace.chips.push(chips);
        }
        Some(trace)
    }
}

impl LinearMap for RevolutionMap<'_> {
    fn size(&self) -> usize {
        self.revolution.size
    }

    fn apply(&self, columns: &DMatrix<f64>) -> Option<DMatrix<f64>> {
        let trace = self.trace(columns)?;
        let mut image = DMatrix::zeros(self.size(), columns.ncols());
        image.rows_mut(0, trace.state.nrows()).copy_from(&trace.state);
        for (series, first) in &self.revolution.kept {
            let piece = &self.revolution.pieces[series.element];
            let values = &trace.seen[series.element];
            for node in 0..piece.gauss.nodes.len() {
                let column = values.column(node * piece.teeth.len() + series.tooth);
                image.row_mut(first + node).tr_copy_from(&column);
            }
        }
        image.iter().all(|entry| entry.is_finite()).then_some(image)
    }
}

impl PeriodMap for RevolutionMap<'_> {
    fn chatter_hz(&self, multiplier: Complex64, vector: &DVector<Complex64>) -> Option<f64> {
        let parts = DMatrix::from_fn(
            vector.len(),
            2,
            |i, j| {
                if j == 0 { vector[i].re } else { vector[i].im }
            },
        );
        let trace = self.trace(&parts)?;
        let problem = &self.revolution.pitched.problem;
        loudest_hz(problem, self.depth_m, self.revolution.period_s, multiplier, |s| {
            let mut harmonic = Vector3::<Complex64>::zeros();
            for (piece, chips) in self.revolution.pieces.iter().zip(&trace.chips) {
                for (port, chip) in piece.element.ports.iter().zip(chips.row_iter()) {
                    let chip = Complex64::new(chip[0], chip[1]) * port.weight_s;
                    harmonic += port.force.map(Complex64::from) * (chip * (-s * port.time_s).exp());
                }
            }
            Some((problem.structure.transfer(s)? * harmonic).norm())
        })
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

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
