//! WAV: every channel is called ch1, ch2 …; the sidecar gives names and units. Full scale is 1.

use std::io::Cursor;
use std::path::Path;

use super::{Raw, RawColumn, RecordingError};

pub(super) fn read(path: &Path) -> Result<Raw, RecordingError> {
    let bytes = crate::file::read(path)?;
    let wrong = |error: hound::Error| RecordingError::Content {
        path: path.into(),
        what: format!("not a WAV file of samples: {error}"),
    };
    let mut reader = hound::WavReader::new(Cursor::new(bytes)).map_err(wrong)?;
    let spec = reader.spec();
    let samples: Result<Vec<f64>, hound::Error> = match spec.sample_format {
        hound::SampleFormat::Float => reader
            .samples::<f32>()
            .map(|sample| sample.map(f64::from))
            .collect(),
        hound::SampleFormat::Int => {
            let full_scale = 2f64.powi(i32::from(spec.bits_per_sample) - 1);
            reader
                .samples::<i32>()
                .map(|sample| sample.map(|sample| f64::from(sample) / full_scale))
                .collect()
        }
    };
    let samples = samples.map_err(wrong)?;
    let count = usize::from(spec.channels.max(1));
    let columns = (0..count)
        .map(|channel| RawColumn {
            name: format!("ch{}", channel + 1),
            unit: None,
            samples: samples.iter().copied().skip(channel).step_by(count).collect(),
        })
        .collect();
    if samples.len() < count {
        return Err(RecordingError::Content {
            path: path.into(),
            what: "there are no samples".into(),
        });
    }
    Ok(Raw {
        columns,
        sample_rate_hz: Some(f64::from(spec.sample_rate)),
    })
}
