//! Reader of WAV files. Channels are called ch1, ch2 …; the sidecar gives names and units. Integer samples are divided
//! by the full scale of their format; floating-point samples are unchanged.
//!
//! The length of the file bounds the allocated memory, whatever sizes its header states.

use std::fs::File;
use std::io::{BufReader, Read};
use std::path::Path;

use super::RecordingError;
use super::raw::{FoundUnit, Raw, RawColumn};
use crate::file::FileError;

/// Reads all channels of a WAV file with its sample rate.
pub(super) fn read(path: &Path) -> Result<Raw, RecordingError> {
    let file = File::open(path).map_err(|cause| FileError::Read {
        path: path.into(),
        cause,
    })?;
    let wrong = |error: hound::Error| RecordingError::Content {
        path: path.into(),
        what: format!("not a WAV file of samples: {error}"),
    };
    let bytes = file
        .metadata()
        .map_err(|cause| FileError::Read {
            path: path.into(),
            cause,
        })?
        .len();
    let mut reader = hound::WavReader::new(BufReader::new(file)).map_err(wrong)?;
    let spec = reader.spec();
    let samples = bytes / u64::from(spec.bits_per_sample.div_ceil(8).max(1));
    if u64::from(spec.channels) > samples {
        return Err(RecordingError::Content {
            path: path.into(),
            what: format!(
                "its header states {} channels, but the file has room for {samples} samples: the header is damaged",
                spec.channels
            ),
        });
    }
    let columns = match spec.sample_format {
        hound::SampleFormat::Float => columns::<f32>(&mut reader, samples, 1.0),
        hound::SampleFormat::Int => {
            let full_scale = 2f64.powi(i32::from(spec.bits_per_sample) - 1);
            columns::<i32>(&mut reader, samples, full_scale)
        }
    }
    .map_err(wrong)?;
    if columns.iter().any(|column| column.samples.is_empty()) {
        return Err(RecordingError::Content {
            path: path.into(),
            what: "there are no samples".into(),
        });
    }
    Ok(Raw {
        columns,
        sample_rate_hz: Some(f64::from(spec.sample_rate)),
        ..Raw::default()
    })
}

/// De-interleaves the samples into channels, each divided by `full_scale`; the length of the file allows at most
/// `samples_max` samples in total.
fn columns<S: hound::Sample + Into<f64>>(
    reader: &mut hound::WavReader<impl Read>,
    samples_max: u64,
    full_scale: f64,
) -> Result<Vec<RawColumn>, hound::Error> {
    let count = usize::from(reader.spec().channels.max(1));
    let most = usize::try_from(samples_max).unwrap_or(usize::MAX) / count;
    let length = most.min(reader.duration() as usize);
    let mut columns: Vec<RawColumn> = (0..count)
        .map(|channel| RawColumn {
            name: format!("ch{}", channel + 1),
            unit: FoundUnit::None,
            samples: Vec::with_capacity(length),
        })
        .collect();
    for (index, sample) in reader.samples::<S>().enumerate() {
        columns[index % count].samples.push(sample?.into() / full_scale);
    }
    Ok(columns)
}
