//! Combines the columns of a file with its sidecar into a recording in SI units.

use std::path::Path;

use super::criteria::UNEVEN;
use super::raw::{Raw, RawColumn};
use super::{Channel, Quantity, Recording, RecordingError, Sensitivity, Sidecar, Unit};

/// Builds the recording: applies names, units and sensitivities of the sidecar, and determines the sample rate.
pub(super) fn recording(path: &Path, raw: Raw, sidecar: Sidecar) -> Result<Recording, RecordingError> {
    let mut time = None;
    let mut channels: Vec<Channel> = Vec::with_capacity(raw.columns.len());
    let columns: Vec<String> = raw.columns.iter().map(|column| column.name.clone()).collect();
    if let Some(stranger) = sidecar.channels.keys().find(|name| !columns.contains(name)) {
        return Err(RecordingError::Content {
            path: Sidecar::path_of(path),
            what: format!(
                "channels.{stranger}: the recording has no such channel, but {}",
                columns.join(", ")
            ),
        });
    }
    for column in raw.columns {
        let channel = channel(path, column, &sidecar)?;
        if channel.name == "t" {
            time = Some(channel.samples);
        } else if channels.iter().any(|other| other.name == channel.name) {
            return Err(RecordingError::Content {
                path: path.into(),
                what: format!("two channels are called \"{}\"", channel.name),
            });
        } else {
            channels.push(channel);
        }
    }
    let (sample_rate_hz, start_s) = match (&time, raw.sample_rate_hz.or(sidecar.sample_rate_hz)) {
        (Some(time), _) => even_rate(path, time)?,
        (None, Some(rate)) => (rate, raw.start_s),
        (None, None) => {
            return Err(RecordingError::NoSampleRate {
                path: path.into(),
                sidecar: Sidecar::path_of(path),
            });
        }
    };
    if channels.is_empty() {
        return Err(RecordingError::Content {
            path: path.into(),
            what: "there is no channel beside time".into(),
        });
    }
    Ok(Recording {
        path: path.into(),
        sample_rate_hz,
        start_s,
        since_s: 0.0,
        channels,
        sidecar,
    })
}

/// Converts a column to a channel with its standard name, in SI units.
fn channel(path: &Path, column: RawColumn, sidecar: &Sidecar) -> Result<Channel, RecordingError> {
    let RawColumn {
        name,
        mut unit,
        mut samples,
    } = column;
    let said = sidecar.channels.get(&name).cloned().unwrap_or_default();
    let in_sidecar = |what: String| RecordingError::Content {
        path: Sidecar::path_of(path),
        what: format!("channels.{name}.{what}"),
    };
    if let Some(text) = &said.unit {
        let stated: Unit = text
            .parse()
            .map_err(|error| in_sidecar(format!("unit: {error}")))?;
        unit = Some(stated);
    }
    let (mut quantity, mut factor) =
        unit.map_or((Quantity::Unknown, 1.0), |unit| (unit.quantity, unit.factor));
    if let Some(text) = &said.sensitivity {
        let sensitivity: Sensitivity = text
            .parse()
            .map_err(|error| in_sidecar(format!("sensitivity: {error}")))?;
        if quantity != Quantity::Voltage {
            return Err(in_sidecar(format!(
                "sensitivity: only a voltage has one, and the channel is {quantity} ({})",
                quantity.unit()
            )));
        }
        quantity = sensitivity.quantity;
        factor /= sensitivity.volts_per_unit;
    }
    let name = said.name.unwrap_or_else(|| conventional(&name));
    // A voltage without sensitivity may represent any quantity, so it contradicts no channel name.
    if let Some(expected) = Quantity::of_name(&name)
        && ![expected, Quantity::Voltage, Quantity::Unknown].contains(&quantity)
    {
        return Err(RecordingError::Quantity {
            path: path.into(),
            column: name,
            found: quantity,
            expected,
        });
    }
    if factor != 1.0 {
        for sample in &mut samples {
            *sample *= factor;
        }
    }
    Ok(Channel {
        name,
        quantity,
        samples,
    })
}

/// Standard form of a channel name: lower case, with `t` for time.
fn conventional(name: &str) -> String {
    let name = name.to_lowercase();
    if name == "time" { "t".into() } else { name }
}

/// Sample rate (samples per second) and first time (s) of evenly spaced time stamps; uneven stamps are an error.
fn even_rate(path: &Path, time: &[f64]) -> Result<(f64, f64), RecordingError> {
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
            index + 1,
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
    for (index, stamp) in time.iter().enumerate() {
        let expected = first + step * index as f64;
        if (stamp - expected).abs() > UNEVEN * step {
            return Err(wrong(format!(
                "time is not even: sample {} stands at {stamp} s, {expected} s was expected; resample it first",
                index + 1
            )));
        }
    }
    Ok((1.0 / step, *first))
}
