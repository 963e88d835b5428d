//! Periods, noise and nonlinear distortion of a multisine in the answer of `quietcut frf`.

use std::fmt::Write;

use serde::Serialize;

use crate::frf::{DistortionLevel, PeriodicTest, ResponseDistortion};
use crate::report::digits::significant;

/// Evaluation of a test with periodic excitation.
#[derive(Serialize)]
pub(super) struct MultisineAnswer {
    period_s: f64,
    /// Number of averaged periods of each recording, in the order of the recordings.
    periods_used: Vec<usize>,
    /// Number of whole periods of each recording that are left out, in the order of the recordings.
    periods_dropped: Vec<usize>,
    /// Number of different sets of phases among the recordings.
    realizations: usize,
    distortion: Vec<DistortionAnswer>,
}

/// Levels of noise and distortion of one response, relative to the response around the peak of the receptance, dB.
#[derive(Serialize)]
struct DistortionAnswer {
    response: &'static str,
    peak_hz: f64,
    /// Noise after averaging; `null` if it is 0.
    noise_db: Option<f64>,
    /// Nonlinear distortion from the scatter over realizations; `null` if [`ResponseDistortion::total`] is `None` or
    /// not significant.
    distortion_db: Option<f64>,
    /// Distortion at even lines without force; `null` if [`ResponseDistortion::even`] is `None` or not significant.
    even_db: Option<f64>,
    /// Distortion at odd lines without force; `null` if [`ResponseDistortion::odd`] is `None` or not significant.
    odd_db: Option<f64>,
    /// True if at least one of the three distortions was measured, significant or not.
    is_tested: bool,
}

/// Level of an amplitude ratio, dB; `None` unless the ratio is above 0.
fn decibel(ratio: f64) -> Option<f64> {
    (ratio > 0.0).then(|| 20.0 * ratio.log10())
}

fn level(level: Option<DistortionLevel>) -> Option<f64> {
    level
        .filter(|level| level.is_significant)
        .and_then(|level| decibel(level.ratio))
}

impl MultisineAnswer {
    pub(super) fn new(test: &PeriodicTest) -> Self {
        let of_response = |found: &ResponseDistortion| DistortionAnswer {
            response: found.response.name(),
            peak_hz: found.peak_hz,
            noise_db: decibel(found.noise),
            distortion_db: level(found.total),
            even_db: level(found.even),
            odd_db: level(found.odd),
            is_tested: found.total.is_some() || found.even.is_some() || found.odd.is_some(),
        };
        Self {
            period_s: test.period_s,
            periods_used: test.used.clone(),
            periods_dropped: test.dropped.clone(),
            realizations: test.realizations,
            distortion: test.distortions.iter().map(of_response).collect(),
        }
    }

    /// Lines of the terminal output, each after a line break.
    pub(super) fn text(&self) -> String {
        let (used, dropped): (usize, usize) =
            (self.periods_used.iter().sum(), self.periods_dropped.iter().sum());
        let recordings = self.periods_used.len();
        let mut text = format!(
            "\nperiod {} s: {used} periods averaged, {dropped} left out (transient or change of the force), {recordings} {}, {} {} of phases",
            significant(self.period_s, 6),
            if recordings == 1 {
                "recording"
            } else {
                "recordings"
            },
            self.realizations,
            if self.realizations == 1 {
                "realization"
            } else {
                "realizations"
            }
        );
        for found in &self.distortion {
            let of = |level: f64, what: &str| format!("{what} {level:.0} dB");
            let mut parts: Vec<String> = [
                (found.noise_db, "noise"),
                (found.distortion_db, "nonlinear distortion"),
                (found.even_db, "even distortion"),
                (found.odd_db, "odd distortion"),
            ]
            .into_iter()
            .filter_map(|(level, what)| level.map(|level| of(level, what)))
            .collect();
            if !found.is_tested {
                parts.push(
                    "nonlinear distortion not known from one realization without detection lines".into(),
                );
            } else if found.distortion_db.or(found.even_db).or(found.odd_db).is_none() {
                parts.push("no nonlinear distortion above the noise".into());
            }
            // Writing to a String cannot fail.
            let _ = write!(
                text,
                "\nresponse in {}, relative to its peak at {} Hz: {}",
                found.response,
                significant(found.peak_hz, 5),
                parts.join(", ")
            );
        }
        text
    }
}
