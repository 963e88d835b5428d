//! Lines of a receptance at which the force causes the response.

use quietcut_numerics::statistics::median;

use crate::criteria::RELATED_COHERENCE;
use crate::frf::Frf;

/// Number of neighbours on each side of a line whose coherence counts with its own.
const NEIGHBOURS: usize = 2;

/// True if the force causes the response at a line and around it: the coherence at the line, and the median of the
/// coherences at the line and its [`NEIGHBOURS`], are at least [`RELATED_COHERENCE`]. Also true if the coherence is not
/// known. With few impacts the coherence of a single line can be large by chance.
pub(super) fn is_related(entry: &Frf, line: usize) -> bool {
    entry.coherence.as_ref().is_none_or(|coherence| {
        let end = coherence.len().min(line + NEIGHBOURS + 1);
        let mut around = coherence[line.saturating_sub(NEIGHBOURS).min(end)..end].to_vec();
        coherence.get(line).is_some_and(|own| *own >= RELATED_COHERENCE)
            && median(&mut around).is_some_and(|median| median >= RELATED_COHERENCE)
    })
}

/// Index of the line at which `size` is largest among the lines that [`is_related`] accepts; among all lines if it
/// accepts none. Noise of an accelerometer divided by ω² may be larger at the first lines than a resonance.
pub(super) fn largest(entry: &Frf, size: impl Fn(usize) -> f64) -> usize {
    let among = |of: &dyn Fn(usize) -> bool| {
        (0..entry.receptance.len())
            .filter(|line| of(*line))
            .max_by(|&a, &b| size(a).total_cmp(&size(b)))
    };
    among(&|line| is_related(entry, line))
        .or_else(|| among(&|_| true))
        .unwrap_or(0)
}
