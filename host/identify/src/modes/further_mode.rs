//! Modes that the stabilization diagram misses: poles that stay the same over too few model orders, since noise in
//! small receptances changes their shapes, although the residual of the fit shows them clearly.

use quietcut_numerics::statistics::chi_squared_quantile;

use super::pole_residue::PoleResidue;
use super::receptances::Receptances;
use super::refinement::{Refined, refine, residue_freedom};
use super::residual_search::{self, GRID_SHARE};
use super::weights::root_mean_square;
use crate::criteria::{CHANCE_OF_FURTHER_MODE, FURTHER_ERROR};

/// Largest number of poles that are tried as a further mode. A choice: a wrong one among the best is rare.
const TRIED: usize = 4;

/// The fit with one more mode, with the first of the poles of [`residual_search::further`] that gives a more likely fit, a mode that noise does
/// not explain and no spurious one. `None` if there is no such pole, or if the residual of
/// `refined` is small already.
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
    let freedom = residue_freedom(data.responses.len(), data.forces.len()) + 2;
    let chance = CHANCE_OF_FURTHER_MODE / search.tried.max(1) as f64;
    let needed = chi_squared_quantile(1.0 - chance, freedom as f64);
    search
        .starts
        .into_iter()
        .filter(|(gain, _)| *gain >= GRID_SHARE * needed)
        .find_map(|(_, start)| {
            let larger = refine(data, start)?;
            let is_mode = larger.evidence(last) >= needed
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
