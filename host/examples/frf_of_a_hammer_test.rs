//! Frequency response functions of a hammer test: the peak of each receptance, with its coherence.
//!
//! `cargo run --release -p quietcut --example frf_of_a_hammer_test -- tap-x.csv tap-y.csv`
//!
//! A recording has the columns `t [s]`, `fx [N]` or `fy [N]`, and motions such as `x [m]` or `ax [m/s^2]`; the sidecar
//! beside it says `kind = "hammer"`.

use std::error::Error;
use std::fmt::Write;
use std::path::PathBuf;

use quietcut::frf::{Estimator, MeasurementSettings, measure};
use quietcut::recording::Recording;

fn main() -> Result<(), Box<dyn Error>> {
    let recordings: Vec<_> = std::env::args().skip(1).map(PathBuf::from).collect();
    if recordings.is_empty() {
        return Err("name the recordings: frf_of_a_hammer_test tap-x.csv tap-y.csv".into());
    }
    print!("{}", peaks(&recordings)?);
    Ok(())
}

/// The warnings of the measurement and the largest |H| of each receptance from 5 to 40 Hz, as text.
pub fn peaks(recordings: &[PathBuf]) -> Result<String, Box<dyn Error>> {
    let recordings = recordings
        .iter()
        .map(Recording::read)
        .collect::<Result<Vec<_>, _>>()?;
    let settings = MeasurementSettings {
        // H1 averages the noise of the responses out: the hammer's force is the cleaner signal.
        estimator: Estimator::H1,
        band_hz: Some((5.0, 40.0)),
        ..MeasurementSettings::default()
    };
    let measurement = measure(&recordings, &settings)?;
    let mut text = String::new();
    for warning in &measurement.warnings {
        writeln!(text, "note: {warning}")?;
    }
    let frequency_hz = measurement.table.frequency_hz();
    for frf in measurement.table.entries() {
        let peak = (0..frequency_hz.len()).max_by(|&a, &b| {
            let size = |line: usize| frf.receptance[line].norm();
            size(a).total_cmp(&size(b))
        });
        let Some(peak) = peak else { continue };
        let coherence = frf.coherence.as_ref().map_or(f64::NAN, |values| values[peak]);
        writeln!(
            text,
            "H{}: {:.3} µm/N at {:.2} Hz, coherence {coherence:.3}",
            frf.name(),
            1e6 * frf.receptance[peak].norm(),
            frequency_hz[peak],
        )?;
    }
    // `measurement.table.write(path)` writes the FRF table as CSV; `quietcut identify --method modes` reads that.
    Ok(text)
}
