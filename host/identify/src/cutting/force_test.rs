//! A cutting test: forces, and displacements where they were measured, over the spindle angle.

use std::f64::consts::TAU;

use nalgebra::Vector3;

use crate::criteria::{ENGAGED_SHARE, LEAST_REVOLUTIONS};
use quietcut_model::milling::EdgeAngle;
use quietcut_model::structure::feed_axes;
use quietcut_recording::{Quantity, Recording, RecordingError, SpindleAngle};

/// A recorded cut with forces in feed, normal and axial direction, in SI units. Sample 0 is the first sample with a
/// spindle angle.
#[derive(Clone, Debug)]
pub struct CuttingTest {
    /// Axial depth, m.
    pub depth_m: f64,
    /// Immersion angle of entry, rad.
    pub start: f64,
    /// Immersion angle of exit, rad.
    pub exit: f64,
    /// Feed per tooth, m.
    pub feed_per_tooth_m: f64,
    /// Number of teeth, at equal pitch.
    pub teeth: usize,
    /// Edge angle γ.
    pub edge_angle: EdgeAngle,
    /// Spindle angle of each sample, rad, ascending.
    pub angle: Vec<f64>,
    /// Force on the tool at each sample in feed, normal and axial direction, N.
    pub force: Vec<Vector3<f64>>,
    /// False if the axial force was not measured; the axial entries of `force` are then 0.
    pub has_axial_force: bool,
    /// Displacement of the tool at each sample in feed, normal and axial direction, m, from the measured axes; `None`
    /// if no displacement was measured.
    pub displacement: Option<Vec<Vector3<f64>>>,
    /// First sample of full engagement, and the sample after its last one. They bound whole revolutions unless their
    /// times were set.
    pub full_cut: [usize; 2],
}

/// Edge angle, feed direction and time of full engagement of a cutting test, which the recording does not contain.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Setup {
    /// Edge angle γ, degrees.
    pub edge_angle_deg: f64,
    /// Angle from the machine's x axis to the feed direction, degrees.
    pub feed_direction_deg: f64,
    /// Start and end of full engagement, s; `None` derives them from the force.
    pub full_cut_s: Option<[f64; 2]>,
}

impl CuttingTest {
    /// The cutting test in a recording with forces and a tachometer.
    ///
    /// # Errors
    /// No usable tachometer, no fx or no fy, a cut that the sidecar does not describe completely, or too few
    /// revolutions of full engagement.
    pub fn new(recording: &Recording, setup: Setup) -> Result<Self, RecordingError> {
        let cut = recording.sidecar.cut.unwrap_or_default();
        let said = |value: Option<f64>, key: &str| {
            value.ok_or_else(|| RecordingError::Content {
                path: quietcut_recording::Sidecar::path_of(&recording.path),
                what: format!("[cut] {key} is needed and not there"),
            })
        };
        let depth_mm = said(cut.axial_depth_mm, "axial_depth_mm")?;
        let start_deg = said(cut.start_deg, "start_deg")?;
        let exit_deg = said(cut.exit_deg, "exit_deg")?;
        let feed_mm = said(cut.feed_per_tooth_mm, "feed_per_tooth_mm")?;
        let teeth = said(cut.teeth.map(f64::from), "teeth")? as u32;
        let SpindleAngle { first, rad: angle } = SpindleAngle::new(recording, teeth)?;
        if recording.channel("fx").is_none() || recording.channel("fy").is_none() {
            return Err(recording.lacks("fx and fy, the forces on the tool"));
        }
        let machine_from_feed = feed_axes(setup.feed_direction_deg);
        let vectors = |names: [&str; 3], quantity: Quantity| {
            let channels = names.map(|name| {
                recording
                    .channel(name)
                    .filter(|channel| channel.quantity == quantity)
            });
            let at = |sample: usize| {
                let of_machine = Vector3::from(
                    channels.map(|channel| channel.map_or(0.0, |channel| channel.samples[sample])),
                );
                machine_from_feed.tr_mul(&of_machine)
            };
            let is_there = channels.iter().any(Option::is_some);
            is_there.then(|| (first..first + angle.len()).map(at).collect::<Vec<_>>())
        };
        let force = vectors(["fx", "fy", "fz"], Quantity::Force).unwrap_or_default();
        let displacement = vectors(["x", "y", "z"], Quantity::Displacement);
        let mut test = Self {
            depth_m: 1e-3 * depth_mm,
            start: start_deg.to_radians(),
            exit: exit_deg.to_radians(),
            feed_per_tooth_m: 1e-3 * feed_mm,
            teeth: teeth as usize,
            edge_angle: EdgeAngle::new(setup.edge_angle_deg),
            angle,
            force,
            has_axial_force: recording.channel("fz").is_some(),
            displacement,
            full_cut: [0, 0],
        };
        let window = setup.full_cut_s.map(|ends| {
            ends.map(|end_s| {
                let sample = ((end_s - recording.start_s) * recording.sample_rate_hz).max(0.0) as usize;
                sample.saturating_sub(first).min(test.angle.len())
            })
        });
        test.find_full_cut(window).ok_or_else(|| RecordingError::Content {
            path: recording.path.clone(),
            what: format!(
                "fewer than {LEAST_REVOLUTIONS} whole revolutions in full cut; record longer, or say from when to when the tool is in full cut (--cut-s)"
            ),
        })?;
        Ok(test)
    }

    /// Angle from tooth to tooth, rad.
    pub fn pitch(&self) -> f64 {
        TAU / self.teeth as f64
    }

    /// Index of the first sample whose spindle angle is at or beyond `angle`, rad.
    pub fn sample_at(&self, angle: f64) -> usize {
        self.angle.partition_point(|&known| known < angle)
    }

    /// Whole revolutions of full engagement, as ranges of samples. The first revolution of the recording does not
    /// count: it only generates the surface that the second one cuts.
    pub fn revolutions(&self) -> Vec<[usize; 2]> {
        let [from, to] = self.full_cut;
        if to <= from {
            return Vec::new();
        }
        let (first, last) = (self.angle[from], self.angle[to - 1]);
        let (first, last) = ((first / TAU).ceil() as i64, (last / TAU).floor() as i64);
        (first..last)
            .map(|turn| [turn, turn + 1].map(|turn| self.sample_at(TAU * turn as f64)))
            .filter(|[from, to]| to > from)
            .collect()
    }

    /// Sets `full_cut` to the samples of full engagement: those in `window`, or if it is not given, those that the
    /// force shows. `None` if they contain too few whole revolutions.
    fn find_full_cut(&mut self, window: Option<[usize; 2]>) -> Option<()> {
        let (first, last) = (*self.angle.first()?, *self.angle.last()?);
        // The first revolution generates the surface that the second one cuts.
        let warm = self.sample_at(TAU * (first / TAU).ceil() + TAU);
        self.full_cut = [warm, self.sample_at(TAU * (last / TAU).floor())];
        if let Some([from, to]) = window {
            self.full_cut = [warm.max(from), self.full_cut[1].min(to)];
        } else {
            let revolutions = self.revolutions();
            let size = |[from, to]: &[usize; 2]| {
                let sum: f64 = self.force[*from..*to].iter().map(Vector3::norm).sum();
                sum / (to - from) as f64
            };
            let sizes: Vec<f64> = revolutions.iter().map(size).collect();
            let mut sorted = sizes.clone();
            sorted.sort_by(f64::total_cmp);
            // At least a quarter of the revolutions are assumed to be in full engagement, so that the upper quartile of
            // their mean forces is that of full engagement.
            let full = *sorted.get(3 * sorted.len() / 4)?;
            let above = |share: f64| sizes.iter().position(|size| *size > share * full);
            let below = |share: f64| sizes.iter().rposition(|size| *size > share * full);
            let (rise, fall) = (above(ENGAGED_SHARE)?, below(ENGAGED_SHARE)?);
            // Revolutions of the entry, in which the mean force grows from a tenth to nine tenths of that in full
            // engagement. After them, half as many and two more are left out: with a linear rise, the last tenth would
            // take only an eighth as many. The exit is treated alike.
            let way_in = rise - above(1.0 - ENGAGED_SHARE)?;
            let way_out = below(1.0 - ENGAGED_SHARE)? - fall;
            let beyond = |way: usize| if way > 0 { way / 2 + 2 } else { 0 };
            let from = rise + beyond(way_in);
            let to = fall.checked_sub(beyond(way_out))?;
            if to < from {
                return None;
            }
            self.full_cut = [revolutions[from][0], revolutions[to][1]];
        }
        (self.revolutions().len() >= LEAST_REVOLUTIONS).then_some(())
    }
}
