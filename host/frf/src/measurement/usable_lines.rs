//! Selection of the frequency lines with sufficient and independent forces.

use super::recording_group::RecordingGroup;
use crate::criteria::{DEPENDENT, EXCITED};
use crate::cross_spectra::CrossSpectra;
use crate::estimate::{ChannelCounts, FrfLine};

/// Removes the frequency lines of a sweep at which the power of the forces, summed over all forces and tests, is at
/// most [`EXCITED`] of the largest such power of all lines; they count as outside the swept range.
pub(super) fn keep_excited(lines: &mut Vec<FrfLine>, spectra: &[CrossSpectra], counts: ChannelCounts) {
    let power = |line: usize| -> f64 {
        let forces = (0..counts.forces).map(|force| {
            spectra
                .iter()
                .map(|test| test.at(line, force, force).re)
                .sum::<f64>()
        });
        forces.sum()
    };
    let frequency_hz = spectra.first().map_or(&[][..], |test| &test.frequency_hz);
    let largest = (0..frequency_hz.len()).map(power).fold(0.0, f64::max);
    let is_excited = |line: &FrfLine| {
        let at = frequency_hz.partition_point(|&hertz| hertz < line.frequency_hz);
        at < frequency_hz.len() && power(at) > EXCITED * largest
    };
    lines.retain(is_excited);
}

/// Removes the frequency lines at which the smallest singular value of the forces is below [`DEPENDENT`], and lists
/// their frequencies in `group`. For several forces, also sets [`RecordingGroup::least_singular`]. An error if more
/// than half of the lines are dependent, or if there is no line.
pub(super) fn independent(
    lines: &mut Vec<FrfLine>,
    group: &mut RecordingGroup,
    counts: ChannelCounts,
) -> Result<(), String> {
    let count = lines.len();
    let dependent: Vec<FrfLine> = lines
        .iter()
        .filter(|line| line.singular.0 < DEPENDENT)
        .copied()
        .collect();
    let names: Vec<String> = group
        .forces
        .iter()
        .map(|direction| format!("f{direction}"))
        .collect();
    if count == 0 || dependent.len() * 2 > count {
        let example = dependent.first().map_or_else(String::new, |line| {
            format!(
                " At {:.2} Hz the smallest singular value of the forces is {:.1e}; {DEPENDENT} is needed.",
                line.frequency_hz, line.singular.0
            )
        });
        return Err(format!(
            "{} drive no independent motion at {} of {count} frequencies.{example} Take porous material, tests of other \
             immersions as well, or drive one direction at a time",
            names.join(", "),
            dependent.len()
        ));
    }
    lines.retain(|line| line.singular.0 >= DEPENDENT);
    group.left_out_hz = dependent.iter().map(|line| line.frequency_hz).collect();
    if counts.forces > 1 {
        group.least_singular = lines
            .iter()
            .map(|line| line.singular.0)
            .fold(f64::INFINITY, f64::min);
    }
    Ok(())
}
