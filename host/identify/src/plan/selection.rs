//! A search for the cheapest set of tests that narrows the 90 % interval of every stability limit to the required
//! width.
//!
//! Tests are added one by one, each the one that most reduces the excess Σ max(0, (width/required width)² − 1) over the
//! limits per unit of cost. Then tests are dropped, or exchanged for cheaper ones, as long as the required width stays
//! reached. A test that brackets a limit costs as many cuts as bisections are needed from the limit's interval before
//! the test down to the bracket width, but at least two.

use nalgebra::DMatrix;
use rayon::prelude::*;

use super::candidate::{Candidate, Test};
use super::chart::KnownChart;
use crate::criteria::{LEAST_GAIN, MOST_TESTS};

/// A test of the plan.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Chosen {
    /// Index of the test among the candidates.
    pub(super) candidate: usize,
    /// Number of cuts of a test that brackets a limit; 1 for every other test.
    pub(super) cost: usize,
}

/// Search for the cheapest set of candidate tests that reaches the required width of all limits' intervals.
pub(super) struct Selection<'a> {
    chart: &'a KnownChart,
    candidates: &'a [Candidate],
    width: f64,
    nothing: DMatrix<f64>,
}

impl<'a> Selection<'a> {
    pub(super) fn new(chart: &'a KnownChart, candidates: &'a [Candidate], width: f64) -> Self {
        let size = chart
            .limits
            .first()
            .map_or(0, |limit| limit.planes[0].gradient.len());
        Self {
            chart,
            candidates,
            width,
            nothing: DMatrix::identity(size, size),
        }
    }

    /// Inverse covariance Λ of the unknown parameters after the tests `chosen`.
    pub(super) fn information(&self, chosen: &[Chosen]) -> DMatrix<f64> {
        chosen.iter().fold(self.nothing.clone(), |sum, one| {
            sum + &self.candidates[one.candidate].information
        })
    }

    /// True if the interval of every limit has at most the required width when the unknowns have the inverse covariance
    /// `information`.
    pub(super) fn is_reached(&self, information: &DMatrix<f64>) -> bool {
        self.excess(information) == 0.0
    }

    /// The cheapest set of tests found that reaches the required width. If the tests that were added one by one do not
    /// reach it, these tests.
    pub(super) fn fewest(&self) -> Vec<Chosen> {
        let mut chosen = self.greedy();
        if self.is_reached(&self.information(&chosen)) {
            while let Some(cheaper) = self.without_one(&chosen).or_else(|| self.with_another(&chosen)) {
                chosen = cheaper;
            }
        }
        chosen
    }

    fn excess(&self, information: &DMatrix<f64>) -> f64 {
        self.chart
            .widths(information)
            .iter()
            .map(|width| ((width / self.width).powi(2) - 1.0).max(0.0))
            .sum()
    }

    /// True if the candidate test is a series of cuts that brackets a stability limit.
    pub(super) fn is_bracket(&self, candidate: usize) -> bool {
        self.candidates[candidate].limit.is_some()
    }

    /// Cost of a candidate test when the unknowns have the inverse covariance `information`: the number of cuts, or 1
    /// for other tests.
    fn cost(&self, candidate: usize, information: &DMatrix<f64>) -> usize {
        let Candidate {
            limit: Some(limit),
            test: Test::Cuts { bracket_mm, .. },
            ..
        } = &self.candidates[candidate]
        else {
            return 1;
        };
        let [from, to] = self.chart.intervals(information)[*limit];
        // Each cut halves the interval of the limit's depth; at least one stable and one unstable cut are necessary.
        let halvings = ((to - from) / bracket_mm).log2().ceil();
        if halvings.is_finite() {
            (halvings as usize).max(2)
        } else {
            2
        }
    }

    /// The candidate tests `order` with their costs when they are carried out in this order.
    pub(super) fn priced(&self, order: impl IntoIterator<Item = usize>) -> Vec<Chosen> {
        let mut information = self.nothing.clone();
        order
            .into_iter()
            .map(|candidate| {
                let cost = self.cost(candidate, &information);
                information += &self.candidates[candidate].information;
                Chosen { candidate, cost }
            })
            .collect()
    }

    fn greedy(&self) -> Vec<Chosen> {
        let mut order = Vec::new();
        let mut information = self.nothing.clone();
        let mut excess = self.excess(&information);
        while excess > 0.0 && order.len() < MOST_TESTS {
            let gains: Vec<(f64, f64)> = (0..self.candidates.len())
                .into_par_iter()
                .map(|candidate| {
                    // No test is made twice.
                    if order.contains(&candidate) {
                        return (f64::NEG_INFINITY, excess);
                    }
                    let after = self.excess(&(&information + &self.candidates[candidate].information));
                    let cost = self.cost(candidate, &information) as f64;
                    // Candidate tests that reach the required width reduce the excess equally and are compared by cost
                    // alone.
                    ((excess - after) / cost, after)
                })
                .collect();
            let best = (0..gains.len()).max_by(|&a, &b| gains[a].0.total_cmp(&gains[b].0).then(b.cmp(&a)));
            let Some(best) = best.filter(|&best| excess - gains[best].1 > LEAST_GAIN * excess) else {
                break;
            };
            order.push(best);
            information += &self.candidates[best].information;
            excess = gains[best].1;
        }
        self.priced(order)
    }

    fn total(chosen: &[Chosen]) -> usize {
        chosen.iter().map(|one| one.cost).sum()
    }

    /// The tests in the given order with their costs, if they reach the required width and their total cost is below
    /// `than`.
    fn if_cheaper(&self, order: Vec<usize>, than: usize) -> Option<Vec<Chosen>> {
        let priced = self.priced(order);
        (Self::total(&priced) < than && self.is_reached(&self.information(&priced))).then_some(priced)
    }

    /// The set without its most expensive test among those whose omission keeps the required width reached and lowers
    /// the total cost; `None` if there is no such test.
    fn without_one(&self, chosen: &[Chosen]) -> Option<Vec<Chosen>> {
        let mut dearest: Vec<usize> = (0..chosen.len()).collect();
        dearest.sort_by_key(|&index| std::cmp::Reverse(chosen[index].cost));
        dearest.into_iter().find_map(|left_out| {
            let order = chosen
                .iter()
                .enumerate()
                .filter(|(index, _)| *index != left_out)
                .map(|(_, one)| one.candidate);
            self.if_cheaper(order.collect(), Self::total(chosen))
        })
    }

    /// The cheapest set that reaches the required width at a lower total cost, with one or two tests exchanged for one
    /// candidate; `None` if there is none.
    fn with_another(&self, chosen: &[Chosen]) -> Option<Vec<Chosen>> {
        let total = Self::total(chosen);
        let count = chosen.len();
        let pairs: Vec<(usize, usize)> = (0..count).flat_map(|a| (a..count).map(move |b| (a, b))).collect();
        pairs
            .par_iter()
            .filter_map(|&(a, b)| {
                (0..self.candidates.len())
                    .filter(|other| chosen.iter().all(|one| one.candidate != *other))
                    .filter_map(|other| {
                        let kept = (0..count)
                            .filter(|&index| index != a && index != b)
                            .map(|index| chosen[index].candidate);
                        // Tests that bracket a limit come last: then the intervals are narrower and the brackets need
                        // fewer cuts.
                        let mut order: Vec<usize> = kept.chain([other]).collect();
                        order.sort_by_key(|&candidate| self.is_bracket(candidate));
                        self.if_cheaper(order, total)
                    })
                    .min_by_key(|priced| Self::total(priced))
            })
            .min_by_key(|priced| Self::total(priced))
    }
}
