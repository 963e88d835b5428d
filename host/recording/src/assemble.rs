//! Combines the columns of a file with its sidecar and the options of the user into a recording in SI units.

use std::path::Path;

use super::criteria::{LOWEST_RATE, UNEVEN};
use super::import::Import;
use super::plausibility;
use super::raw::Raw;
use super::understand::understand;
use super::understood::{Basis, Understood, UnderstoodColumn};
use super::{Channel, Quantity, Recording, RecordingError, Sidecar};

/// A recording in SI units, and the report of how its file was understood.
#[derive(Clone, Debug, PartialEq)]
pub struct Imported {
    /// The recording.
    pub recording: Recording,
    /// Report of how the file was understood.
    pub understood: Understood,
}

/// Builds a recording from the columns of one record of a file: applies names, units and sensitivities, and determines
/// the sample rate. `known` are the column names of all records of the file; a column that sidecar or map names must be
/// among them.
pub(super) fn recording(
    path: &Path,
    raw: Raw,
    mut sidecar: Sidecar,
    import: &Import,
    known: &[String],
) -> Result<Imported, RecordingError> {
    if raw.unnamed_line.is_some() || raw.asks_names {
        require_names(path, &raw, &sidecar, import)?;
    }
    let has_rate = raw.sample_rate_hz.or(raw.worded_rate_hz).is_some();
    let meanings = understand(path, &raw, &sidecar, import, known).map_err(|error| match error {
        RecordingError::Doubt {
            path,
            sidecar,
            doubts,
            lacks_rate,
        } => RecordingError::Doubt {
            path,
            sidecar,
            doubts,
            lacks_rate: lacks_rate && !has_rate,
        },
        other => other,
    })?;
    let mut time = None;
    let mut channels: Vec<Channel> = Vec::with_capacity(raw.columns.len());
    let mut columns = Vec::with_capacity(raw.columns.len());
    let names: Vec<String> = raw.columns.iter().map(|column| column.name.clone()).collect();
    let numbers: Vec<usize> = (0..names.len()).map(|index| raw.number(index)).collect();
    for (index, (column, meaning)) in raw.columns.into_iter().zip(meanings).enumerate() {
        let mapped = import
            .map
            .iter()
            .find(|map| map.is_about(&names[index], numbers[index], &names));
        if let Some(point) = mapped.and_then(|map| map.point.as_ref()) {
            let described = sidecar.channels.entry(column.name.clone()).or_default();
            described.at = Some(point.clone());
            if column.name != meaning.name {
                let sign = if meaning.is_negative { "-" } else { "" };
                described.name = Some(format!("{sign}{}", meaning.name));
            }
        }
        // What the sidecar says of a column holds for its channel, whatever that is called; messages name the column.
        if column.name != meaning.name && meaning.from != Basis::Auxiliary && meaning.name != "t" {
            let described = sidecar.channels.entry(column.name.clone()).or_default();
            described.name.get_or_insert_with(|| meaning.name.clone());
        }
        columns.push(UnderstoodColumn {
            column: column.name,
            channel: meaning.name.clone(),
            is_negative: meaning.is_negative,
            unit: meaning.unit,
            sensitivity: meaning.sensitivity,
            si_unit: meaning.quantity.unit(),
            from: meaning.from,
        });
        let mut samples = column.samples;
        if meaning.factor != 1.0 {
            for sample in &mut samples {
                *sample *= meaning.factor;
            }
        }
        if meaning.name == "t" {
            time = Some(samples);
        } else if channels.iter().any(|other| other.name == meaning.name) {
            return Err(RecordingError::Content {
                path: path.into(),
                what: format!("two channels are called \"{}\"", meaning.name),
            });
        } else {
            channels.push(Channel {
                name: meaning.name,
                quantity: meaning.quantity,
                samples,
            });
        }
    }
    let mut notes = raw.notes;
    let mut since_s = 0.0;
    let (sample_rate_hz, start_s, rate_from) =
        match (import.rate_hz, &time, raw.sample_rate_hz, sidecar.sample_rate_hz) {
            (Some(rate), time, ..) => {
                if time.is_some() {
                    notes.push("the time column is replaced by --rate".into());
                }
                (rate, raw.start_s, "option")
            }
            (None, Some(time), ..) => {
                let (rate, start) = match even_rate(path, time, 0) {
                    // A gap outside of the segment does not matter.
                    Err(_) if !import.segment.is_whole() => {
                        let range = import.segment.of_stamps(time);
                        let first = time.iter().find(|stamp| stamp.is_finite());
                        since_s = time
                            .get(range.start)
                            .zip(first)
                            .map_or(0.0, |(start, first)| start - first);
                        for channel in &mut channels {
                            if let Some(samples) = channel.samples.get(range.clone()) {
                                channel.samples = samples.to_vec();
                            }
                        }
                        even_rate(path, &time[range.clone()], range.start)?
                    }
                    found => found?,
                };
                (rate, start, "time column")
            }
            (None, None, Some(rate), _) => (rate, raw.start_s, "file"),
            (None, None, None, Some(rate)) => (rate, raw.start_s, "sidecar"),
            (None, None, None, None) => match raw.worded_rate_hz {
                Some(rate) => (rate, raw.start_s, "file"),
                None => {
                    return Err(RecordingError::NoSampleRate {
                        path: path.into(),
                        sidecar: Sidecar::path_of(path),
                        without_unit: channels
                            .iter()
                            .filter(|channel| channel.quantity == Quantity::Unknown)
                            .map(|channel| channel.name.clone())
                            .filter(|name| Quantity::of_name(name).is_some())
                            .collect(),
                    });
                }
            },
        };
    if channels.is_empty() {
        return Err(RecordingError::Content {
            path: path.into(),
            what: "there is no channel beside time".into(),
        });
    }
    let recording = Recording {
        path: path.into(),
        sample_rate_hz,
        start_s,
        since_s,
        channels,
        sidecar,
    };
    let mut warnings = plausibility::warnings(&recording);
    let time_without_unit = columns
        .iter()
        .find(|column| column.channel == "t" && column.unit.is_none());
    if let Some(column) = time_without_unit
        && rate_from == "time column"
        && sample_rate_hz < LOWEST_RATE
    {
        warnings.push(format!(
            "column \"{name}\" has no unit and is read in seconds, which gives {sample_rate_hz} samples/s; --map {name}=t:ms if it is in \
             milliseconds",
            name = column.column
        ));
    }
    Ok(Imported {
        understood: Understood {
            file: path.into(),
            record: raw.label,
            sample_rate_hz,
            rate_from,
            columns,
            notes,
            warnings,
        },
        recording,
    })
}

/// Error unless the option `--map` or the sidecar names at least one of the columns, whose names in the file say
/// nothing.
fn require_names(path: &Path, raw: &Raw, sidecar: &Sidecar, import: &Import) -> Result<(), RecordingError> {
    let names: Vec<String> = raw.columns.iter().map(|column| column.name.clone()).collect();
    let is_named = |index: usize| {
        import
            .map
            .iter()
            .any(|map| map.is_about(&names[index], raw.number(index), &names))
            || sidecar
                .channels
                .get(&names[index])
                .is_some_and(|said| said.name.is_some())
    };
    if (0..names.len()).any(is_named) {
        return Ok(());
    }
    let first = raw.columns.first().map_or(&[][..], |column| &column.samples);
    let grows = names.len() > 1 && first.len() > 1 && even_rate(path, first, 0).is_ok();
    let words: &[&str] = if grows {
        &["t:s", "fx:N", "ax:m/s^2", "ay:m/s^2", "az:m/s^2"]
    } else {
        &["fx:N", "ax:m/s^2", "ay:m/s^2", "az:m/s^2"]
    };
    let map: Vec<String> = names
        .iter()
        .zip(words)
        .map(|(name, word)| format!("{name}={word}"))
        .collect();
    let rate = if grows || raw.sample_rate_hz.or(raw.worded_rate_hz).is_some() {
        ""
    } else {
        " --rate 25600"
    };
    let map = format!("--map {}{rate} with the names and units that hold", map.join(","));
    Err(match raw.unnamed_line {
        Some(line) => RecordingError::Line {
            path: path.into(),
            line,
            what: format!(
                "numbers without a row of names before them, in {} columns; add {map}, or a row of names such as t [s],fx [N],ax [m/s^2]{}",
                names.len(),
                if grows && names.len() > 2 {
                    "; for receptances --map 1=frequency_hz,2=hxx_re:m/N,3=hxx_im:m/N"
                } else {
                    ""
                }
            ),
        },
        None => RecordingError::Content {
            path: path.into(),
            what: format!(
                "one matrix with the channels {}, whose names say nothing; add {map}, or [channels.{}] with name and unit to {}",
                names.join(", "),
                names.first().map_or("", String::as_str),
                Sidecar::path_of(path).display()
            ),
        },
    })
}

/// Sample rate (samples per second) and first time (s) of evenly spaced time stamps, before which the file has `from`
/// others. An error if there are fewer than
/// two stamps, if one is not finite, if the last is not above the first, or if one deviates from even spacing by more
/// than [`UNEVEN`] steps.
fn even_rate(path: &Path, time: &[f64], from: usize) -> Result<(f64, f64), RecordingError> {
    let wrong = |what: String| RecordingError::Content {
        path: path.into(),
        what,
    };
    let (Some(first), Some(last)) = (time.first(), time.last()) else {
        return Err(wrong("there are no samples".into()));
    };
    if let Some(index) = time.iter().position(|stamp| !stamp.is_finite()) {
        return Err(wrong(format!(
            "time of sample {} is {}; a number is needed",
            from + index + 1,
            time[index]
        )));
    }
    if time.len() < 2 || last <= first {
        return Err(wrong(format!(
            "time goes from {first} to {last} s in {} samples; it must grow",
            time.len()
        )));
    }
    let step = (last - first) / (time.len() - 1) as f64;
    let is_off = |(index, stamp): (usize, &f64)| {
        let expected = first + step * index as f64;
        (stamp - expected).abs() > UNEVEN * step
    };
    if time.iter().enumerate().any(is_off) {
        return Err(wrong(uneven(time, from)));
    }
    Ok((1.0 / step, *first))
}

/// Error text for time stamps that are not evenly spaced: the step of largest absolute value, with its place, and the
/// median step.
fn uneven(time: &[f64], from: usize) -> String {
    let mut steps: Vec<f64> = time.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let largest = (0..steps.len())
        .max_by(|&a, &b| steps[a].abs().total_cmp(&steps[b].abs()))
        .unwrap_or(0);
    let gap = steps.get(largest).copied().unwrap_or(0.0);
    steps.sort_by(f64::total_cmp);
    let usual = steps.get(steps.len() / 2).copied().unwrap_or(0.0);
    let (after, at) = (from + largest + 1, time.get(largest).copied().unwrap_or(0.0));
    if usual <= 0.0 {
        return format!(
            "stamps repeat, so that they are rounded: the usual step is {usual} s, and the largest {gap:.6e} s after sample {after} at {at} s; \
             state the rate with --rate"
        );
    }
    // Each other step may be rounded, as the stamps of an even record are.
    let missing = (gap / usual).round() - 1.0;
    let others = steps.iter().rev().skip(1);
    if missing >= 1.0 && others.clone().all(|step| (step - usual).abs() <= UNEVEN * usual) {
        let next = time.get(largest + 1).copied().unwrap_or(at);
        return format!(
            "time is not even: about {missing} samples are missing after sample {after} at {at} s; use the part before it with --until-s {next}, or \
             that after it with --from-s {next}"
        );
    }
    format!(
        "time is not even: the largest step is {gap:.6e} s after sample {after} at {at} s, and the usual one {usual:.6e} s; resample it first, or state \
         the rate with --rate if the stamps are only rounded"
    )
}
