//! The received state as texts for the page, one JSON object for each topic.

use axum::extract::ws::Utf8Bytes;
use quietcut_core::lobes::Column;
use quietcut_core::monitor::Band;
use serde::Serialize;

use crate::monitor::lobes::{LobeMap, letter};
use crate::monitor::received::{Connection, Received, STRIP_S};
use crate::monitor::sentences;
use crate::report::answer::number;
use crate::report::words;

/// Number of topics.
pub(super) const TOPICS: usize = 8;

/// Bands of the sensor with their names.
const BANDS: [(Band, &str); 2] = [(Band::Structure, "structure"), (Band::Tool, "tool")];

/// Level of a bin without power, dB: a choice below the noise of every sensor.
const SILENCE_DB: f64 = -200.0;

/// Newest text of each topic, with the number of its changes.
#[derive(Clone, Debug, Default)]
pub(super) struct Frames {
    texts: [Utf8Bytes; TOPICS],
    numbers: [u64; TOPICS],
}

impl Frames {
    /// Updates the verdict and all that belongs to it.
    pub(super) fn take_head(&mut self, received: &Received) {
        self.set(0, &Head::new(received));
        self.set(1, &Strip::new(received));
        self.set(2, &History::new(received));
    }

    /// Updates spectra, maps and lobes.
    pub(super) fn take_charts(&mut self, received: &Received) {
        for (index, (band, name)) in BANDS.into_iter().enumerate() {
            self.set(3 + index, &SpectrumFrame::new(received, band, name));
            self.set(5 + index, &MapFrame::new(received, band, name));
        }
        self.set(7, &LobesFrame::new(received.lobes.as_ref()));
    }

    fn set(&mut self, topic: usize, content: &impl Serialize) {
        // Texts and numbers always have a JSON.
        let text = serde_json::to_string(content).unwrap_or_default();
        if let (Some(kept), Some(number)) = (self.texts.get_mut(topic), self.numbers.get_mut(topic))
            && kept.as_str() != text
        {
            *kept = text.into();
            *number += 1;
        }
    }

    /// Texts that changed since those with the numbers `sent`, which become the present ones.
    pub(super) fn take_newer(&self, sent: &mut [u64; TOPICS]) -> Vec<Utf8Bytes> {
        let topics = self.texts.iter().zip(&self.numbers).zip(sent);
        topics
            .filter(|((_, number), sent)| *number != *sent)
            .map(|((text, number), sent)| {
                *sent = *number;
                text.clone()
            })
            .collect()
    }
}

/// Verdict, speed, advice, margin and connection.
#[derive(Serialize)]
#[serde(tag = "topic", rename = "head")]
struct Head<'a> {
    port: &'a str,
    connection: &'static str,
    connection_text: String,
    device: String,
    t_s: Option<f64>,
    verdict: Option<&'static str>,
    alarm: bool,
    word: &'static str,
    sentence: String,
    rpm: Option<f64>,
    tooth_hz: Option<f64>,
    chatter_hz: Option<f64>,
    advice: String,
    reason: String,
    margin: String,
}

impl<'a> Head<'a> {
    fn new(received: &'a Received) -> Self {
        Self {
            port: &received.port,
            connection: match received.connection {
                Connection::Connecting => "connecting",
                Connection::Up => "up",
                Connection::Gone(_) => "gone",
            },
            connection_text: received.connection_text(),
            device: received.device_text(),
            t_s: received.report.map(|report| report.time.0 as f64 / 1e9),
            verdict: received.verdict().map(words::verdict_key),
            alarm: received
                .report
                .is_some_and(|report| report.alarm || report.judgement.verdict.is_chatter()),
            word: received.word(),
            sentence: received.sentence(),
            rpm: received.rpm(),
            tooth_hz: received.tooth_hz(),
            chatter_hz: received.chatter_hz(),
            advice: received.advice_text(),
            reason: received.reason_text(),
            margin: received.margin_text(),
        }
    }
}

/// Verdicts of the last time as letters, oldest first.
#[derive(Serialize)]
#[serde(tag = "topic", rename = "strip")]
struct Strip {
    cell_s: f64,
    letters: String,
}

impl Strip {
    fn new(received: &Received) -> Self {
        Self {
            cell_s: STRIP_S,
            letters: received
                .strip
                .iter()
                .map(|verdict| sentences::letter(*verdict))
                .collect(),
        }
    }
}

/// Lines of the history, newest first.
#[derive(Serialize)]
#[serde(tag = "topic", rename = "history")]
struct History<'a> {
    lines: Vec<&'a str>,
}

impl<'a> History<'a> {
    fn new(received: &'a Received) -> Self {
        Self {
            lines: received.lines.iter().rev().map(String::as_str).collect(),
        }
    }
}

/// One spectrum.
#[derive(Serialize)]
#[serde(tag = "topic", rename = "spectrum")]
struct SpectrumFrame {
    band: &'static str,
    bin_hz: f64,
    /// End of the frequency scale that shows tooth passing and chatter, Hz.
    fitted_end_hz: f64,
    /// Level of each bin, in tenths of a dB relative to 1 m/s².
    decibel_tenths: Vec<i32>,
}

impl SpectrumFrame {
    fn new(received: &Received, band: Band, name: &'static str) -> Self {
        let spectrum = received.spectrum(band);
        let level = |power: &f32| (10.0 * f64::from(*power).log10()).clamp(SILENCE_DB, -SILENCE_DB);
        Self {
            band: name,
            bin_hz: spectrum.bin_hz,
            fitted_end_hz: received.fitted_end_hz(band),
            decibel_tenths: spectrum
                .power
                .iter()
                .map(|power| (10.0 * level(power)).round() as i32)
                .collect(),
        }
    }
}

/// Stroboscopic map of one band.
#[derive(Serialize)]
#[serde(tag = "topic", rename = "map")]
struct MapFrame {
    band: &'static str,
    /// Accelerations in x, y and z at each tooth passing, in tenths of mm/s², and its number; oldest first.
    points: Vec<(i32, i32, i32, u32)>,
}

impl MapFrame {
    fn new(received: &Received, band: Band, name: &'static str) -> Self {
        let tenths = |value: f32| (10_000.0 * value).round() as i32;
        Self {
            band: name,
            points: received
                .strobes(band)
                .iter()
                .map(|strobe| {
                    let [x, y, z] = strobe.meters_per_second2.map(tenths);
                    (x, y, z, strobe.tooth)
                })
                .collect(),
        }
    }
}

/// Lobes of the table at the working point.
#[derive(Serialize)]
#[serde(tag = "topic", rename = "lobes")]
struct LobesFrame {
    /// Slowest and fastest speed, rev/min; `None` without a table.
    rpm: Option<[f64; 2]>,
    /// Largest depth, mm.
    depth_mm: f64,
    /// Depth of the working point, mm; `None` if none is set.
    working_depth_mm: Option<f64>,
    /// Unstable depths, from and to in mm, with their letter; `None` where the table has none for this cut.
    columns: Vec<Option<Vec<(f64, f64, char)>>>,
}

impl LobesFrame {
    fn new(lobes: Option<&LobeMap>) -> Self {
        let unstable = |column: &Column| {
            let intervals = column.intervals().iter();
            intervals
                .map(|interval| {
                    (
                        number(interval.from.0),
                        number(interval.to.0),
                        letter(interval.kind),
                    )
                })
                .collect()
        };
        Self {
            rpm: lobes.map(|lobes| lobes.rpm),
            depth_mm: lobes.map_or(0.0, |lobes| lobes.depth_mm),
            working_depth_mm: lobes.and_then(LobeMap::working_depth_mm),
            columns: lobes.map_or_else(Vec::new, |lobes| {
                let columns = lobes.columns().iter();
                columns.map(|column| column.as_ref().map(unstable)).collect()
            }),
        }
    }
}
