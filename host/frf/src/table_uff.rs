//! FRF tables in UFF 58: a complex function of type 4 per receptance, a real function of type 6 for its coherence.

use std::f64::consts::TAU;
use std::path::Path;

use num_complex::Complex64;

use super::{Frf, FrfError, FrfTable};
use quietcut_model::structure::Direction;
use quietcut_recording::uff::{
    Axis, DataSet, DegreeOfFreedom, Function, Header, Ordinate, OrdinateType, UffForm, Values, axis_of,
    data_sets, unit, write_set, write_units,
};
use quietcut_recording::{Quantity, RecordingError, Unit};

impl From<RecordingError> for FrfError {
    fn from(error: RecordingError) -> Self {
        match error {
            RecordingError::File(cause) => Self::File(cause),
            RecordingError::Line { path, line, what } => Self::Line { path, line, what },
            other => Self::Recording(other),
        }
    }
}

/// Reads an FRF table from UFF 58: the functions of type 4, each with its coherence (type 6) if the file has one with
/// as many values.
pub(super) fn read(path: &Path) -> Result<FrfTable, FrfError> {
    let sets = data_sets(path)?;
    let found: Vec<i64> = sets.iter().map(|set| set.header.function.code()).collect();
    let mut entries: Vec<Frf> = Vec::new();
    let mut above_zero: Option<Vec<f64>> = None;
    // Mobility and accelerance cannot be integrated at 0 Hz: then the table has no line there.
    let mut has_zero_hz = true;
    for set in sets
        .iter()
        .filter(|set| set.header.function == Function::FrequencyResponse)
    {
        let wrong = |what: String| FrfError::Line {
            path: path.into(),
            line: set.line,
            what,
        };
        let frequencies = frequencies(set).map_err(wrong)?;
        let mut entry = receptance(set, &frequencies).map_err(wrong)?;
        let begins_at_zero = frequencies.first() == Some(&0.0);
        has_zero_hz &= begins_at_zero && entry.receptance.first().is_some_and(|value| value.is_finite());
        let own = &frequencies[usize::from(begins_at_zero)..];
        if above_zero.get_or_insert_with(|| own.to_vec()) != own {
            return Err(wrong(format!(
                "h{} has {} frequencies, and the first FRF has others; above 0 Hz all must have the same",
                entry.name(),
                frequencies.len()
            )));
        }
        let coherence = sets.iter().find(|other| is_coherence_of(other, set));
        if let Some(Ordinate::Real(values)) = coherence.map(|other| &other.ordinate)
            && values.len() == frequencies.len()
        {
            entry.coherence = Some(values.clone());
        }
        entries.push(entry);
    }
    if entries.is_empty() {
        return Err(FrfError::Content {
            path: path.into(),
            what: format!(
                "its functions are of type {found:?}; frequency response functions, type 4, are needed"
            ),
        });
    }
    let mut frequency_hz = above_zero.unwrap_or_default();
    if has_zero_hz {
        frequency_hz.insert(0, 0.0);
    }
    for entry in &mut entries {
        keep_last(&mut entry.receptance, frequency_hz.len());
        if let Some(coherence) = &mut entry.coherence {
            keep_last(coherence, frequency_hz.len());
        }
    }
    FrfTable::new(path, frequency_hz, entries)
}

/// Removes the first values, so that at most `count` are left.
fn keep_last<T>(values: &mut Vec<T>, count: usize) {
    values.drain(..values.len().saturating_sub(count));
}

fn frequencies(set: &DataSet) -> Result<Vec<f64>, String> {
    let hertz = match set.header.abscissa.unit.to_lowercase().as_str() {
        "" | "hz" | "hertz" | "1/s" => 1.0,
        "rad/s" => 1.0 / TAU,
        "rpm" => 1.0 / 60.0,
        other => return Err(format!("frequencies in \"{other}\"; Hz or rad/s is needed")),
    };
    Ok(match (&set.uneven, set.header.even) {
        (Some(values), _) => values.iter().map(|value| value * hertz).collect(),
        (None, Some((first, step))) => (0..set.ordinate.len())
            .map(|index| (first + step * index as f64) * hertz)
            .collect(),
        (None, None) => Vec::new(),
    })
}

fn receptance(set: &DataSet, frequency_hz: &[f64]) -> Result<Frf, String> {
    let header = &set.header;
    let (response, a) = direction(&header.response, "response")?;
    let (force, b) = direction(&header.reference, "reference")?;
    let (factor, derivatives) = compliance(set)?;
    let Ordinate::Complex(values) = &set.ordinate else {
        return Err("an FRF with real values; complex ones are needed".into());
    };
    let receptance = values
        .iter()
        .zip(frequency_hz)
        .map(|(value, hertz)| value * (a * b * factor) / Complex64::new(0.0, TAU * hertz).powi(derivatives))
        .collect();
    Ok(Frf {
        response,
        force,
        receptance,
        coherence: None,
        folding: None,
    })
}

fn direction(dof: &DegreeOfFreedom, what: &str) -> Result<(Direction, f64), String> {
    let axis = match dof.direction.abs() {
        1 => Direction::X,
        2 => Direction::Y,
        3 => Direction::Z,
        _ => {
            return Err(format!(
                "{what} direction {}; 1, 2 or 3 (x, y, z), with sign, is needed",
                dof.direction
            ));
        }
    };
    Ok((axis, dof.direction.signum() as f64))
}

/// Conversion factor of an FRF to SI, and order of the time derivative of displacement: 0 receptance, 1 mobility, 2
/// accelerance. An error for a unit of none of them.
fn compliance(set: &DataSet) -> Result<(f64, i32), String> {
    let needed = "receptance (m/N), mobility (m/s/N) or accelerance (m/s^2/N) is needed";
    let (ordinate, denominator) = ratio(set)?;
    let derivatives = match ordinate.quantity {
        Quantity::Displacement => 0,
        Quantity::Velocity => 1,
        Quantity::Acceleration => 2,
        other => return Err(format!("an FRF of {other}; {needed}")),
    };
    if denominator.quantity != Quantity::Force {
        return Err(format!("an FRF per {}; {needed}", denominator.quantity));
    }
    Ok((ordinate.factor / denominator.factor, derivatives))
}

/// Units of numerator (response) and denominator (force) of an FRF. Some programs write both into the unit label of the
/// ordinate, such as `(m/s^2)/N`.
fn ratio(set: &DataSet) -> Result<(Unit, Unit), String> {
    let Header {
        ordinate,
        denominator,
        ..
    } = &set.header;
    let lacks = |what: &str| {
        format!("the unit of the {what} is not said; receptance, mobility and accelerance need it")
    };
    if denominator.kind == 0
        && denominator.unit.is_empty()
        && let Some((above, below)) = ordinate.unit.rsplit_once('/')
        && let Ok(below) = below.trim().parse::<Unit>()
        && below.quantity == Quantity::Force
    {
        let above = Axis {
            unit: above.trim().trim_start_matches('(').trim_end_matches(')').into(),
            ..ordinate.clone()
        };
        return Ok((unit(&above, set.units)?.ok_or_else(|| lacks("response"))?, below));
    }
    Ok((
        unit(ordinate, set.units)?.ok_or_else(|| lacks("response"))?,
        unit(denominator, set.units)?.ok_or_else(|| lacks("reference"))?,
    ))
}

fn is_coherence_of(other: &DataSet, set: &DataSet) -> bool {
    let place = |set: &DataSet| {
        let Header {
            response, reference, ..
        } = &set.header;
        (
            response.node,
            response.direction.abs(),
            reference.node,
            reference.direction.abs(),
        )
    };
    other.header.function == Function::Coherence && place(other) == place(set)
}

impl FrfTable {
    /// Writes the table to `path` as UFF 58, receptances in m/N, atomically: on an error the previous file stays
    /// unchanged. Text keeps thirteen digits of receptances and coherences, binary all. An evenly spaced table is
    /// written with seven digits of first frequency and spacing; otherwise text keeps seven digits of each frequency,
    /// binary all.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write_uff(&self, path: &Path, form: UffForm) -> Result<(), FrfError> {
        let even = self.even();
        let uneven = even.is_none().then(|| self.frequency_hz());
        quietcut_recording::file::write_with(path, |out| {
            write_units(out)?;
            for entry in self.entries() {
                let header = header(entry, even);
                write_set(out, &header, uneven, Values::Complex(&entry.receptance), form)?;
                if let Some(coherence) = &entry.coherence {
                    let header = Header {
                        function: Function::Coherence,
                        ordinate: axis_of(Quantity::Level),
                        denominator: Axis::default(),
                        ordinate_type: OrdinateType {
                            is_double: true,
                            is_complex: false,
                        },
                        ..header
                    };
                    write_set(out, &header, uneven, Values::Real(coherence), form)?;
                }
            }
            Ok(())
        })?;
        Ok(())
    }

    /// First frequency and line spacing of an evenly spaced table, Hz, both rounded to seven digits. `None` if they
    /// miss a frequency of the table by more than 0.001 line spacings, or if the table has one line.
    fn even(&self) -> Option<(f64, f64)> {
        let (&first, &last) = (self.frequency_hz().first()?, self.frequency_hz().last()?);
        let count = self.frequency_hz().len();
        if count < 2 {
            return None;
        }
        let seven = |value: f64| format!("{value:.6e}").parse::<f64>().unwrap_or(value);
        let (first, step) = (seven(first), seven((last - first) / (count - 1) as f64));
        let is_even = self
            .frequency_hz()
            .iter()
            .enumerate()
            .all(|(index, hertz)| (hertz - first - step * index as f64).abs() <= 1e-3 * step);
        is_even.then_some((first, step))
    }
}

fn header(entry: &Frf, even: Option<(f64, f64)>) -> Header {
    let dof = |direction: Direction| DegreeOfFreedom {
        entity: String::new(),
        node: 1,
        direction: direction.axis().map_or(0, |axis| axis as i64 + 1),
    };
    Header {
        words: [
            format!("h{}", entry.name()),
            "receptance of the tool centre point".into(),
            String::new(),
            String::new(),
            String::new(),
        ],
        function: Function::FrequencyResponse,
        response: dof(entry.response),
        reference: dof(entry.force),
        ordinate_type: OrdinateType {
            is_double: true,
            is_complex: true,
        },
        count: entry.receptance.len(),
        even,
        abscissa: Axis {
            kind: 18,
            exponents: [0, 0],
            unit: "Hz".into(),
        },
        ordinate: axis_of(Quantity::Displacement),
        denominator: axis_of(Quantity::Force),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table(step: f64, uneven: f64) -> FrfTable {
        let frequency_hz: Vec<f64> = (1..50)
            .map(|k| step * f64::from(k) + uneven * f64::from(k * k))
            .collect();
        let entry = |response, force, scale: f64| Frf {
            response,
            force,
            receptance: frequency_hz
                .iter()
                .map(|f| Complex64::new(scale * 1e-6 / (1.0 + f), -1e-7 * f))
                .collect(),
            coherence: (scale > 1.0).then(|| frequency_hz.iter().map(|f| 1.0 / (1.0 + f)).collect()),
            folding: None,
        };
        let entries = vec![
            entry(Direction::X, Direction::X, 2.0),
            entry(Direction::Y, Direction::X, 1.0),
        ];
        FrfTable::new(Path::new("a.uff"), frequency_hz.clone(), entries).unwrap()
    }

    #[test]
    fn what_is_written_is_read_back() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.uff");
        for (step, uneven) in [(0.25, 0.0), (0.1, 0.003), (1.0 / 3.0, 0.0)] {
            for form in [UffForm::Text, UffForm::Binary] {
                let written = table(step, uneven);
                written.write_uff(&path, form).unwrap();
                let read = FrfTable::read(&path).unwrap();
                for (a, b) in read.frequency_hz().iter().zip(written.frequency_hz()) {
                    // Tolerance: 0.001 steps, the rounding of the frequencies.
                    assert!((a - b).abs() <= 1e-3 * step, "{a} {b}");
                }
                for (a, b) in read.entries().iter().zip(written.entries()) {
                    assert_eq!(a.name(), b.name());
                    assert_eq!(a.coherence.is_some(), b.coherence.is_some());
                    for (a, b) in a.receptance.iter().zip(&b.receptance) {
                        assert!((a - b).norm() <= 1e-12 * b.norm());
                    }
                }
            }
        }
    }

    fn function(ordinate: &str, denominator: &str) -> String {
        format!(
            "    -1\n    58\nNONE\nNONE\nNONE\nNONE\nNONE\n    4         0    0         0 NONE               1   2 NONE               1  -2\n\
             \x20        6         3         1  0.00000E+00  1.00000E+00  0.00000E+00\n\
             \x20       18    0    0    0 NONE                 Hz\n{ordinate}\n{denominator}\n         0\n\
             \x20 1.0 2.0 1.0 2.0\n 1.0 2.0\n    -1\n"
        )
    }

    #[test]
    fn the_line_at_0_hz_is_left_out_whichever_function_has_none_there() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.uff");
        let force = "        13    0    1    0 NONE                 N";
        let receptance = function("         8    1    0    0 NONE                 m", force);
        let accelerance = function("        12    1    0    0 NONE                 m/s^2", force)
            .replace("1   2 NONE ", "1   1 NONE ");
        let alone = receptance.clone();
        for (text, lines) in [
            (alone, 3),
            (format!("{receptance}{accelerance}"), 2),
            (format!("{accelerance}{receptance}"), 2),
        ] {
            std::fs::write(&path, text).unwrap();
            let table = FrfTable::read(&path).unwrap();
            assert_eq!(table.frequency_hz().len(), lines);
            let yy = table.entries().iter().find(|entry| entry.name() == "yy").unwrap();
            assert_eq!(*yy.receptance.last().unwrap(), -Complex64::new(1.0, 2.0));
        }
    }

    #[test]
    fn receptance_mobility_and_accelerance_are_distinguished() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.uff");
        let force = "        13    0    1    0 NONE                 N";
        let read = |ordinate: &str, denominator: &str| {
            std::fs::write(&path, function(ordinate, denominator)).unwrap();
            FrfTable::read(&path)
        };
        let value = Complex64::new(1.0, 2.0);
        let omega = Complex64::new(0.0, TAU);
        // The reference direction is negative, so the sign is reversed.
        for (ordinate, denominator, expected, lines) in [
            (
                "         8    1    0    0 NONE                 m",
                force,
                -value,
                3,
            ),
            (
                "         8    1    0    0 NONE                 mm",
                force,
                -value * 1e-3,
                3,
            ),
            (
                "        11    1    0    0 NONE                 m/s",
                force,
                -value / omega,
                2,
            ),
            (
                "        12    1    0    0 NONE                 g",
                force,
                -value * 9.806_65 / (omega * omega),
                2,
            ),
            (
                "        12    1    0    0 NONE                 NONE",
                "        13",
                -value / (omega * omega),
                2,
            ),
            (
                "         1    0    0    0 NONE                 (m/s^2)/N",
                "         0",
                -value / (omega * omega),
                2,
            ),
        ] {
            let table = read(ordinate, denominator).unwrap();
            let at = table.frequency_hz().iter().position(|&f| f == 1.0).unwrap();
            assert_eq!(table.frequency_hz().len(), lines, "{ordinate}");
            assert_eq!(table.entries()[0].name(), "yy");
            assert!(
                (table.entries()[0].receptance[at] - expected).norm() < 1e-15,
                "{ordinate}"
            );
        }
        for (ordinate, denominator, words) in [
            (
                "         1    0    0    0 NONE                 NONE",
                force,
                "response is not said",
            ),
            (
                "        12    1    0    0 NONE                 m/s^2",
                "         0",
                "reference is not said",
            ),
            (
                "        13    1    0    0 NONE                 N",
                force,
                "an FRF of force",
            ),
            (
                "        12    1    0    0 NONE                 m/s^2",
                "         8    1    0    0 NONE                 m",
                "per displacement",
            ),
            (
                "        12    1    0    0 NONE                 m/s",
                force,
                "velocity",
            ),
        ] {
            let said = read(ordinate, denominator).unwrap_err().to_string();
            assert!(
                said.contains(words) && said.contains("line 2"),
                "{ordinate}: {said}"
            );
        }
    }
}
