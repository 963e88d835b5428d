//! Answer of `--method mode-shapes`: modes with shapes over points.

use serde::Serialize;

use super::backbone_answer::quoted;
use super::figure::Figure;
use super::mode_lines::mac_lines;
use crate::frf::PointGroup;
use crate::identify::modes::point_direction::PointDirection;
use crate::identify::modes::points::{FrequencyShift, PointMode, PointModes, assurance};
use crate::recording::Recording;
use crate::report::digits::significant;
use crate::report::shape_chart::DrawnShape;

/// Result of `--method mode-shapes`.
#[derive(Debug, Serialize)]
pub(super) struct ModeShapes {
    /// Places that are both driven and measured; without any the shapes are relative to their largest entry.
    drive_points: Vec<Place>,
    /// True if the shapes are mass-normalized, 1/√kg; false if they are relative to their largest entry.
    pub(super) is_scaled: bool,
    /// By ascending frequency.
    modes: Vec<ShapedMode>,
    /// Modal assurance criterion between the shapes, by rows.
    mac: Vec<Vec<f64>>,
    /// Natural frequencies that differ between the recordings beyond their errors.
    pub(super) shifts: Vec<Shift>,
}

#[derive(Clone, Debug, Serialize)]
struct Place {
    point: String,
    direction: &'static str,
}

#[derive(Debug, Serialize)]
struct ShapedMode {
    frequency_hz: Figure,
    damping_ratio: Figure,
    shape: Vec<Entry>,
}

#[derive(Debug, Serialize)]
struct Entry {
    #[serde(flatten)]
    place: Place,
    re: Figure,
    im: Figure,
}

#[derive(Debug, Serialize)]
pub(super) struct Shift {
    /// Index of the mode, from 0.
    mode: usize,
    lowest_hz: Figure,
    lowest_recordings: Vec<String>,
    highest_hz: Figure,
    highest_recordings: Vec<String>,
}

impl ModeShapes {
    pub(super) fn new(found: &PointModes, groups: &[PointGroup], recordings: &[Recording]) -> Self {
        let place = |of: &PointDirection| Place {
            point: of.point.clone(),
            direction: of.direction.name(),
        };
        let shaped = |mode: &PointMode| ShapedMode {
            frequency_hz: Figure::new(mode.frequency_hz, mode.frequency_std_hz),
            damping_ratio: Figure::new(mode.damping_ratio, mode.damping_ratio_std),
            shape: found
                .places
                .iter()
                .zip(&mode.shape)
                .map(|(of, entry)| Entry {
                    place: place(of),
                    re: Figure::new(entry.value.re, entry.std[0]),
                    im: Figure::new(entry.value.im, entry.std[1]),
                })
                .collect(),
        };
        let names = |group: usize| {
            let of_group = groups[group].recordings.iter();
            of_group
                .map(|at| recordings[*at].path.display().to_string())
                .collect()
        };
        let shift = |shift: &FrequencyShift| Shift {
            mode: shift.mode,
            lowest_hz: Figure::new(shift.lowest.1[0], shift.lowest.1[1]),
            lowest_recordings: names(shift.lowest.0),
            highest_hz: Figure::new(shift.highest.1[0], shift.highest.1[1]),
            highest_recordings: names(shift.highest.0),
        };
        Self {
            drive_points: found.drive_points.iter().map(place).collect(),
            is_scaled: !found.drive_points.is_empty(),
            modes: found.modes.iter().map(shaped).collect(),
            mac: found
                .modes
                .iter()
                .map(|a| found.modes.iter().map(|b| assurance(a, b)).collect())
                .collect(),
            shifts: found.shifts.iter().map(shift).collect(),
        }
    }

    fn unit(&self) -> &'static str {
        if self.is_scaled { "1/√kg" } else { "1" }
    }

    pub(super) fn lines(&self) -> Vec<String> {
        let half = |figure: Figure| 0.5 * (figure.ci90[1] - figure.ci90[0]);
        let mut lines = Vec::new();
        for (index, mode) in self.modes.iter().enumerate() {
            lines.push(format!(
                "mode {}: {} ± {} Hz, damping ratio {} ± {} %; shape [{}]:",
                index + 1,
                significant(mode.frequency_hz.value, 6),
                significant(half(mode.frequency_hz), 2),
                significant(100.0 * mode.damping_ratio.value, 4),
                significant(100.0 * half(mode.damping_ratio), 2),
                self.unit()
            ));
            lines.extend(mode.shape.iter().map(|entry| {
                format!(
                    "  {:>12} {}  {:>9} ± {:<8} {:>9} ± {} i",
                    entry.place.point,
                    entry.place.direction,
                    significant(entry.re.value, 4),
                    significant(half(entry.re), 2),
                    significant(entry.im.value, 4),
                    significant(half(entry.im), 2)
                )
            }));
        }
        lines.extend(mac_lines(&self.mac));
        lines
    }

    /// Table with one line for each entry of each shape, units in the head.
    pub(super) fn csv(&self) -> String {
        let unit = self.unit();
        let mut lines = vec![format!(
            "mode,frequency [Hz],frequency_low [Hz],frequency_high [Hz],damping_ratio [1],damping_ratio_low [1],damping_ratio_high [1],point,direction,re \
             [{unit}],re_low [{unit}],re_high [{unit}],im [{unit}],im_low [{unit}],im_high [{unit}]"
        )];
        let of = |figure: Figure| format!("{:e},{:e},{:e}", figure.value, figure.ci90[0], figure.ci90[1]);
        for (index, mode) in self.modes.iter().enumerate() {
            lines.extend(mode.shape.iter().map(|entry| {
                format!(
                    "{},{},{},{},{},{},{}",
                    index + 1,
                    of(mode.frequency_hz),
                    of(mode.damping_ratio),
                    quoted(&entry.place.point),
                    entry.place.direction,
                    of(entry.re),
                    of(entry.im)
                )
            }));
        }
        lines.join("\n") + "\n"
    }

    pub(super) fn drawn(&self) -> Vec<DrawnShape> {
        let shape = |mode: &ShapedMode| {
            let entries = || mode.shape.iter();
            let largest = entries().fold(0.0, |a: f64, entry| a.max(entry.re.value.hypot(entry.im.value)));
            DrawnShape {
                title: format!("{} Hz", significant(mode.frequency_hz.value, 5)),
                names: entries()
                    .map(|entry| format!("{} {}", entry.place.point, entry.place.direction))
                    .collect(),
                intervals: entries()
                    .map(|entry| entry.re.ci90.map(|end| end / largest))
                    .collect(),
            }
        };
        self.modes.iter().map(shape).collect()
    }
}

impl Shift {
    pub(super) fn in_words(&self, shapes: &ModeShapes, is_of_forces: bool) -> String {
        let half = |figure: Figure| 0.5 * (figure.ci90[1] - figure.ci90[0]);
        let side = |figure: Figure, names: &[String]| {
            format!(
                "{} ± {} Hz in {}",
                significant(figure.value, 6),
                significant(half(figure), 2),
                names.join(", ")
            )
        };
        let why = if is_of_forces {
            "the structure changed between the recordings, as by temperature, clamping or the level of the force"
        } else {
            "the mass of a sensor that moves makes another structure at each position; take a lighter sensor, or leave it in place and move the hammer"
        };
        format!(
            "mode {} at {} Hz has other natural frequencies in the recordings, beyond their intervals: {}, {}. The shape is that of no one structure: {why}",
            self.mode + 1,
            significant(shapes.modes[self.mode].frequency_hz.value, 5),
            side(self.lowest_hz, &self.lowest_recordings),
            side(self.highest_hz, &self.highest_recordings)
        )
    }
}
