//! Mass of the accelerometer: its removal from measured receptances, and the shift of a resonance by a mass.
//!
//! A sensor of mass m that moves with the point of measurement exerts the inertial force −m ẍ on the structure. The
//! measured receptances H_m are those of the structure with this mass: H_m = (H⁻¹ − ω² m I)⁻¹ over the directions in
//! which the sensor moves, so that H = (H_m⁻¹ + ω² m I)⁻¹. For one direction 1/H = 1/H_m + ω² m (Ewins, Modal Testing,
//! 2nd ed. 2000, section 3.4).

use std::f64::consts::TAU;

use nalgebra::DMatrix;
use num_complex::Complex64;
use quietcut_model::structure::Direction;

use super::criteria::PEAK_LINES_MIN;
use super::error::FrfError;
use super::table::{Frf, FrfTable};

/// Removes the mass of the accelerometer, `mass_kg` (kg), from the receptances of a table, and scales the standard
/// deviations `deviation` (a row for each entry of the table, a value for each line) in place. Returns the table, and
/// those directions of its responses and forces in which the mass is not removed, since the table has no drive-point
/// receptance there.
///
/// With the drive points S of the table, H = H_m − ω²m H_m,·S (I + ω²m H_m,SS)⁻¹ H_m,S·. An entry of H_m that the table
/// lacks is taken from its reciprocal, or as zero if the table lacks that too. The deviation of entry ij is divided by
/// |1 + ω²m H_m,ii| |1 + ω²m H_m,jj|, where the factor of a direction without drive point is 1; for a single
/// drive-point receptance this is a multiplication by |dH/dH_m|. Lines at which I + ω²m H_m,SS is singular stay
/// unchanged.
///
/// # Errors
/// The table has no drive-point receptance, or a corrected receptance is not finite.
pub fn without_accelerometer_mass(
    table: &FrfTable,
    deviation: &mut [Vec<f64>],
    mass_kg: f64,
) -> Result<(FrfTable, Vec<Direction>), FrfError> {
    let driven: Vec<Direction> = table
        .entries()
        .iter()
        .filter(|entry| entry.response == entry.force)
        .map(|entry| entry.response)
        .collect();
    if driven.is_empty() {
        return Err(FrfError::Content {
            path: table.path().into(),
            what: "the mass of the accelerometer can be removed only with a receptance of its own direction, such as xx; measure the response in \
                   the direction of the force too, or leave --accelerometer-mass-g out"
                .into(),
        });
    }
    let mut directions = driven.clone();
    for entry in table.entries() {
        for direction in [entry.response, entry.force] {
            if !directions.contains(&direction) {
                directions.push(direction);
            }
        }
    }
    let mut corrected: Vec<Frf> = table.entries().to_vec();
    for (line, &hertz) in table.frequency_hz().iter().enumerate() {
        let loaded = matrix(table, &directions, line);
        // ω² m, N/m.
        let inertia = (TAU * hertz).powi(2) * mass_kg;
        let drive = driven.len();
        let coupled = DMatrix::<Complex64>::identity(drive, drive)
            + loaded.view((0, 0), (drive, drive)).map(|h| h * inertia);
        // Without an inverse, the line keeps its measured values.
        let Some(inverse) = coupled.try_inverse() else {
            continue;
        };
        let count = directions.len();
        let change = loaded.view((0, 0), (count, drive)) * inverse * loaded.view((0, 0), (drive, count));
        let factor = |direction: Direction| {
            let at = driven.iter().position(|other| *other == direction);
            at.map_or(1.0, |at| (1.0 + loaded[(at, at)] * inertia).norm())
        };
        let place = |direction: Direction| directions.iter().position(|other| *other == direction);
        for (index, entry) in corrected.iter_mut().enumerate() {
            if let (Some(p), Some(q)) = (place(entry.response), place(entry.force)) {
                entry.receptance[line] -= change[(p, q)] * inertia;
            }
            if let Some(deviation) = deviation.get_mut(index).and_then(|lines| lines.get_mut(line)) {
                *deviation /= (factor(entry.response) * factor(entry.force)).max(f64::MIN_POSITIVE);
            }
        }
    }
    let table = FrfTable::new(table.path(), table.frequency_hz().to_vec(), corrected)?;
    let loaded_only = directions.split_off(driven.len());
    Ok((table, loaded_only))
}

/// Receptance matrix of one line, m/N: rows displacement, columns force, both in the order of `directions`. An entry
/// that the table lacks is taken from its reciprocal, or as zero if the table lacks that too.
fn matrix(table: &FrfTable, directions: &[Direction], line: usize) -> DMatrix<Complex64> {
    DMatrix::from_fn(directions.len(), directions.len(), |p, q| {
        let entry = table
            .entry(directions[p], directions[q])
            .or_else(|| table.entry(directions[q], directions[p]));
        entry.map_or(Complex64::ZERO, |entry| entry.receptance[line])
    })
}

/// Relative decrease m/(2 m_modal) of the frequency of a resonance by a mass m = `mass_kg` (kg). The resonance is that
/// at the largest |H| of the drive-point receptance in `direction`. The modal mass is that of the straight line
/// Re(1/H) = k − m_modal ω² fitted to the lines between the half-power points.
///
/// `None` if the table lacks the receptance; if |H| does not fall below 1/√2 of its largest value on both sides; if
/// fewer than `PEAK_LINES_MIN` lines lie between the half-power points; or if the fitted Re(1/H) does not decrease with
/// ω².
pub fn peak_shift(table: &FrfTable, direction: Direction, mass_kg: f64) -> Option<PeakShift> {
    let entry = table.entry(direction, direction)?;
    let size = |line: usize| entry.receptance[line].norm();
    let peak = (0..entry.receptance.len()).max_by(|&a, &b| size(a).total_cmp(&size(b)))?;
    let least = size(peak) * std::f64::consts::FRAC_1_SQRT_2;
    let from = (0..peak).rev().find(|&line| size(line) < least)? + 1;
    let to = (peak + 1..entry.receptance.len()).find(|&line| size(line) < least)?;
    if to - from < PEAK_LINES_MIN {
        return None;
    }
    let squares: Vec<f64> = table.frequency_hz()[from..to]
        .iter()
        .map(|hertz| (TAU * hertz).powi(2))
        .collect();
    let stiffness: Vec<f64> = entry.receptance[from..to].iter().map(|h| h.inv().re).collect();
    let count = squares.len() as f64;
    let (mean, level) = (
        squares.iter().sum::<f64>() / count,
        stiffness.iter().sum::<f64>() / count,
    );
    let spread: f64 = squares.iter().map(|square| (square - mean).powi(2)).sum();
    let slope: f64 = squares
        .iter()
        .zip(&stiffness)
        .map(|(square, k)| (square - mean) * (k - level))
        .sum::<f64>()
        / spread;
    let scatter: f64 = squares
        .iter()
        .zip(&stiffness)
        .map(|(square, k)| (k - level - slope * (square - mean)).powi(2))
        .sum::<f64>()
        / (count - 2.0).max(1.0);
    // The resonance is where the straight line crosses zero, taken as near the mean of ω², where the standard deviation
    // of the line is √(scatter/count).
    let frequency_std = (scatter / count).sqrt() / slope.abs() / (2.0 * mean);
    (slope < 0.0).then(|| PeakShift {
        peak_hz: table.frequency_hz()[peak],
        relative: 0.5 * mass_kg / -slope,
        resonance_std: frequency_std,
    })
}

/// Shift of the frequency of a resonance by a mass, from [`peak_shift`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PeakShift {
    /// Frequency of the line with the largest |H|, Hz.
    pub peak_hz: f64,
    /// Relative decrease of the frequency of the resonance by the mass.
    pub relative: f64,
    /// Relative standard deviation of the frequency of the resonance, from the scatter of Re(1/H) about the fitted
    /// straight line.
    pub resonance_std: f64,
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use Direction::{X, Y, Z};

    /// Receptances of two coupled masses in x and y, kg, N/m, N s/m, with `added` kg on both: (K − ω²M + iωC)⁻¹.
    fn closed_form(hertz: f64, added: f64) -> [[Complex64; 2]; 2] {
        let omega = TAU * hertz;
        let dynamic = |k: f64, m: f64, c: f64| Complex64::new(k - omega * omega * m, omega * c);
        let (a, d) = (dynamic(4e6, 0.5 + added, 40.0), dynamic(9e6, 0.8 + added, 60.0));
        let b = dynamic(-6e5, 0.02, -5.0);
        let determinant = a * d - b * b;
        [
            [d / determinant, -b / determinant],
            [-b / determinant, a / determinant],
        ]
    }

    fn table(entries: &[(Direction, Direction)], added: f64) -> FrfTable {
        let frequency_hz: Vec<f64> = (350..700).map(f64::from).collect();
        let of = |&(response, force): &(Direction, Direction)| Frf {
            response,
            force,
            receptance: frequency_hz
                .iter()
                .map(|&hertz| closed_form(hertz, added)[response.axis().unwrap()][force.axis().unwrap()])
                .collect(),
            coherence: None,
            folding: None,
        };
        let entries = entries.iter().map(of).collect();
        FrfTable::new(Path::new("closed form"), frequency_hz.clone(), entries).unwrap()
    }

    fn largest_error(a: &FrfTable, b: &FrfTable) -> f64 {
        let pairs = a.entries().iter().zip(b.entries());
        pairs
            .flat_map(|(a, b)| a.receptance.iter().zip(&b.receptance))
            .map(|(a, b)| (a - b).norm() / b.norm())
            .fold(0.0, f64::max)
    }

    #[test]
    fn the_structure_without_the_mass_is_found_from_that_with_it() {
        let all = [(X, X), (Y, X), (X, Y), (Y, Y)];
        let (loaded, free) = (table(&all, 0.03), table(&all, 0.0));
        assert!(largest_error(&loaded, &free) > 0.5);
        let (found, left) = without_accelerometer_mass(&loaded, &mut [], 0.03).unwrap();
        // Rounding of a few divisions.
        assert!(largest_error(&found, &free) < 1e-11 && left.is_empty());
        // The transfer that is missing comes from reciprocity.
        let three = [(X, X), (Y, X), (Y, Y)];
        let (found, left) = without_accelerometer_mass(&table(&three, 0.03), &mut [], 0.03).unwrap();
        assert!(largest_error(&found, &table(&three, 0.0)) < 1e-11 && left.is_empty());
    }

    #[test]
    fn one_column_is_corrected_in_the_direction_of_its_force() {
        let column = [(X, X), (Y, X)];
        let mut deviation = vec![vec![1e-9; 350]; 2];
        let loaded = table(&column, 0.03);
        let (found, left) = without_accelerometer_mass(&loaded, &mut deviation, 0.03).unwrap();
        assert_eq!(left, [Y]);
        for (line, &hertz) in loaded.frequency_hz().iter().enumerate() {
            let inertia = (TAU * hertz).powi(2) * 0.03;
            let [drive, transfer] = [0, 1].map(|entry: usize| loaded.entries()[entry].receptance[line]);
            let expected = (drive.inv() + inertia).inv();
            assert!((found.entries()[0].receptance[line] / expected - 1.0).norm() < 1e-12);
            let expected = transfer / (1.0 + inertia * drive);
            assert!((found.entries()[1].receptance[line] / expected - 1.0).norm() < 1e-12);
            // The error of H is |dH/dH_m| = |1 + ω²m H_m|⁻² of that of H_m, here by differences.
            let step = 1e-6 * drive;
            let moved = ((drive + step).inv() + inertia).inv();
            let ratio = (moved - found.entries()[0].receptance[line]).norm() / step.norm();
            assert!((deviation[0][line] / 1e-9 / ratio - 1.0).abs() < 1e-4, "{hertz}");
        }
        let error = without_accelerometer_mass(&table(&[(Y, X)], 0.0), &mut [], 0.03).unwrap_err();
        assert!(
            error.to_string().contains("receptance of its own direction"),
            "{error}"
        );
        assert!(without_accelerometer_mass(&loaded, &mut [], 0.0).is_ok_and(|(same, _)| same == loaded));
        let _ = Z;
    }

    #[test]
    fn the_shift_of_a_peak_by_a_mass_is_that_of_its_resonance() {
        let peak = |table: &FrfTable| {
            let receptance = &table.entries()[0].receptance;
            let at = (0..350)
                .max_by(|&a, &b| receptance[a].norm().total_cmp(&receptance[b].norm()))
                .unwrap();
            // A parabola through three lines around the peak.
            let [a, b, c] = [at - 1, at, at + 1].map(|line| receptance[line].norm());
            table.frequency_hz()[at] + 0.5 * (a - c) / (a - 2.0 * b + c)
        };
        let (free, loaded) = (table(&[(X, X)], 0.0), table(&[(X, X)], 0.005));
        let found = peak_shift(&free, X, 0.005).unwrap();
        let true_shift = 1.0 - peak(&loaded) / peak(&free);
        // To first order in the mass ratio of 1 %. The mass moves in y as well, with a fifth of the amplitude: 4 % more
        // inertia.
        assert!(
            (found.relative / true_shift - 1.0).abs() < 0.07,
            "{found:?} {true_shift}"
        );
        assert!(found.resonance_std < 1e-3, "{found:?}");
        assert_eq!(peak_shift(&free, Y, 0.005), None);
    }
}
