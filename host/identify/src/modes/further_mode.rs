//! Modes that the stabilization diagram misses: poles that stay the same over too few model orders, since noise in
//! small receptances changes their shapes, although the residual of the fit shows them clearly.

use quietcut_numerics::statistics::chi_squared_quantile;

use super::pole_residue::{PoleResidue, ShapedPole};
use super::receptances::Receptances;
use super::refinement::{Refined, refine, residue_freedom};
use super::residual_search::{self, GRID_SHARE};
use super::weights::root_mean_square;
use crate::criteria::{CHANCE_OF_FURTHER_MODE, FURTHER_ERROR, LEAST_DAMPING_DEVIATIONS, LEAST_HEIGHT};

/// Largest number of poles that are tried as a further mode. A choice: a wrong one among the best is rare.
const TRIED: usize = 4;

/// The fit with one more mode, with the first of the poles of [`residual_search::further`] that gives a more likely fit, a
/// mode that noise does not explain and no spurious one. `None` if there is no such pole, or if the residual of `refined`
/// is small already.
///
/// `is_spurious` is true for a fit with a spurious mode.
pub(super) fn with_further_mode(
    data: &Receptances,
    refined: &Refined,
    is_spurious: impl Fn(&Refined) -> bool,
) -> Option<Refined> {
    if refined.relative_error < FURTHER_ERROR {
        return None;
    }
    let search = residual_search::further(data, &refined.fit, TRIED);
    let last = refined.fit.modes.len();
    // Noise explains as much at each of the poles that are tried: χ² of the numbers of a matrix of rank one and of the pole.
    let of_rank_one = residue_freedom(data.responses.len(), data.forces.len());
    let freedom = of_rank_one + 2;
    let chance = CHANCE_OF_FURTHER_MODE / search.tried.max(1) as f64;
    let needed = chi_squared_quantile(1.0 - chance, freedom as f64);
    // The search has residue matrices of full rank: noise explains as much by each of their further numbers, one in the mean.
    let of_further_ranks = (2 * data.places.len()).saturating_sub(of_rank_one) as f64;
    let least_gain = GRID_SHARE * needed + of_further_ranks;
    search
        .starts
        .into_iter()
        .filter(|(gain, start)| *gain >= least_gain && is_high(data, start))
        .find_map(|(_, start)| {
            let larger = refine(data, start)?;
            let mode = larger.mode(last);
            let (hertz, damping) = (mode.mode.frequency_hz, mode.mode.damping_ratio);
            let is_mode = larger.evidence(data, last) >= needed
                && residual_search::is_resolved(data, hertz, damping)
                && damping >= LEAST_DAMPING_DEVIATIONS * mode.damping_ratio_std
                && is_high(data, &larger.fit)
                && log_power(data, &larger.fit) < log_power(data, &refined.fit)
                && !is_spurious(&larger);
            is_mode.then_some(larger)
        })
}

/// Sum over the receptances of the logarithm of their weighted RMS residual: up to a constant the negative logarithmic likelihood for
/// each value if the size of the noise of each receptance is not known.
fn log_power(data: &Receptances, fit: &PoleResidue) -> f64 {
    (0..data.values.len())
        .map(|k| root_mean_square(&fit.left_of(data, &data.deviation, k)).ln())
        .sum()
}

/// True if the resonance peak of the last mode of a fit has the height that a stable pole needs to be a mode.
fn is_high(data: &Receptances, fit: &PoleResidue) -> bool {
    let sizes: Vec<f64> = data
        .values
        .iter()
        .map(|values| root_mean_square(values))
        .collect();
    let height = |mode: &ShapedPole| -> f64 {
        let residues = data.places.iter().zip(&sizes);
        let squares = residues.map(|(&(p, q), size)| (mode.right[p] * mode.left[q] / *size).norm_sqr());
        squares.sum::<f64>().sqrt() / -mode.pole.re
    };
    let highest = fit.modes.iter().map(height).fold(0.0, f64::max);
    fit.modes
        .last()
        .is_some_and(|mode| height(mode) > LEAST_HEIGHT * highest)
}
