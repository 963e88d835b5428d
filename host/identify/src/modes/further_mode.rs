//! Modes that the stabilization diagram misses: poles that stay the same over too few model orders, since noise in
//! small receptances changes their shapes, although the residual of the fit shows them clearly.

use num_complex::Complex64;

use super::pole_residue::PoleResidue;
use super::receptances::Receptances;
use super::refinement::{Refined, refine};
use super::stabilization::Stabilization;
use crate::criteria::{FURTHER_ERROR, FURTHER_MISFIT, FURTHER_SIGNIFICANCE};

/// Largest number of known poles at which a second mode is tried, those with the highest peaks of the second part of the residues first. A choice.
const SPLIT: usize = 4;

/// Largest number of poles of the stabilization diagram that are tried as a further mode. A choice.
const TRIED: usize = 8;

/// The fit with one more mode, with the first of the poles of [`Stabilization::further`] that gives a smaller NRMSE, a
/// significant mode and no spurious one. `None` if there is no such pole, or if the residual of `refined` is noise or
/// small already.
///
/// `is_spurious` is true for a fit with a spurious mode.
pub(super) fn with_further_mode(
    data: &Receptances,
    refined: &Refined,
    stabilization: &Stabilization,
    is_spurious: impl Fn(&Refined) -> bool,
) -> Option<Refined> {
    let is_noise = data.has_deviation && refined.misfit < FURTHER_MISFIT;
    if is_noise || refined.relative_error < FURTHER_ERROR {
        return None;
    }
    let known: Vec<Complex64> = refined.fit.modes.iter().map(|mode| mode.pole).collect();
    let of_diagram = stabilization
        .further(&known, TRIED)
        .into_iter()
        .filter_map(|pole| {
            let mut poles = known.clone();
            poles.push(pole);
            PoleResidue::start(data, &poles).ok()
        });
    let starts = of_diagram.chain(refined.fit.split(data, SPLIT));
    starts.into_iter().find_map(|start| {
        let larger = refine(data, start)?;
        let is_mode = larger.significance(known.len()) >= FURTHER_SIGNIFICANCE
            && larger.relative_error < refined.relative_error
            && !is_spurious(&larger);
        is_mode.then_some(larger)
    })
}
