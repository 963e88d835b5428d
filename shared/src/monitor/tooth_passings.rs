//! Samples of both bands: collected for spectra, and resampled at fixed spindle angles into tooth periods.

use super::Band;
use super::angles::{Angles, Place};
use super::band_state::BandState;
use super::pipeline::Monitor;
use super::state::State;
use super::strobe::show;
use crate::criteria::{
    ANGLE_DEVIATION_MAX, GROWTH_INTERVAL_SAMPLES, STRUCTURE_SAMPLES_PER_TOOTH, TOOL_SAMPLES_PER_TOOTH,
};
use crate::decimation::Sample;
use crate::detector::growth::Evaluation;
use crate::math;
use crate::spectrum::{STRUCTURE_POINTS, TOOL_POINTS};
use crate::synchronous::{Method, Passed, SLOTS, Sampler};

/// Number of samples between two spectra of the tool band, which therefore overlap by 1/2.
const TOOL_HOP: usize = TOOL_POINTS / 2;
/// Number of samples between two spectra of the structure band, which therefore overlap by 3/4.
const STRUCTURE_HOP: usize = STRUCTURE_POINTS / 4;

impl Monitor {
    /// True if a band can be resampled at fixed spindle angles: at the sensor's rate divided by `divisor` it has at
    /// least `least` samples per tooth period, and the standard deviation of the spindle angle is small enough.
    fn can_sample(&self, angles: &Angles, divisor: u32, least: f32) -> bool {
        angles.samples_per_tooth >= least * divisor as f32 && angles.deviation < ANGLE_DEVIATION_MAX
    }

    pub(super) fn take_tool(&self, state: &mut State, sample: Sample, place: Place, angles: Option<&Angles>) {
        let band = &mut state.tool;
        band.take(sample, TOOL_HOP);
        let Some(angles) =
            angles.filter(|a| self.can_sample(a, self.decimation.tool_divisor(), TOOL_SAMPLES_PER_TOOTH))
        else {
            return;
        };
        let sampler = Sampler {
            teeth: self.settings.tool.teeth,
            method: Method::Value,
        };
        let angle = angles.at(place, self.decimation.tool_delay());
        let unit = self.unit();
        let Some(passed) = sampler.step(&mut band.sampler, sample.map(|x| x as f32 * unit), angle) else {
            return;
        };
        let rate = self.settings.sensor.nominal_rate.0 / self.decimation.tool_divisor() as f32;
        let noise = self.noise_density() * 0.5 * rate;
        // Slow growth of the vibration is not evaluated in the tool band. The error of cubic interpolation leaves a
        // residual of the forced vibration, which beats with the ratio of tooth period to sample period and would
        // appear as slow growth.
        let look = if band.samples_since_growth >= GROWTH_INTERVAL_SAMPLES {
            Evaluation::Quick
        } else {
            Evaluation::None
        };
        self.take_passing(band, &passed, noise, look);
        // The points of the stroboscopic map come from the tool band only if the tooth period has too few samples of
        // the structure band.
        if !self.can_sample(
            angles,
            self.decimation.structure_divisor(),
            STRUCTURE_SAMPLES_PER_TOOTH,
        ) {
            show(&mut state.strobes, Band::Tool, &passed, self.settings.tool.teeth);
        }
    }

    pub(super) fn take_structure(
        &self,
        state: &mut State,
        sample: Sample,
        place: Place,
        angles: Option<&Angles>,
    ) {
        let band = &mut state.structure;
        band.take(sample, STRUCTURE_HOP);
        let divisor = self.decimation.structure_divisor();
        let Some(angles) = angles.filter(|a| self.can_sample(a, divisor, STRUCTURE_SAMPLES_PER_TOOTH)) else {
            return;
        };
        let sampler = Sampler {
            teeth: self.settings.tool.teeth,
            method: Method::Mean,
        };
        let angle = angles.at(place, self.decimation.structure_delay());
        let unit = self.unit();
        let Some(passed) = sampler.step(&mut band.sampler, sample.map(|x| x as f32 * unit), angle) else {
            return;
        };
        // The mean of white noise over w seconds has the variance of the noise density times a bandwidth of 1/(2w) Hz;
        // w is the duration of one of the equal angles into which a tooth period is divided.
        let rate = self.settings.sensor.nominal_rate.0;
        let bandwidth = 0.5 * rate * SLOTS as f32 / angles.samples_per_tooth;
        let noise = self.noise_density() * bandwidth.min(0.5 * rate / divisor as f32);
        self.take_passing(band, &passed, noise, Evaluation::Close);
        show(
            &mut state.strobes,
            Band::Structure,
            &passed,
            self.settings.tool.teeth,
        );
    }

    /// Passes a complete tooth period of a band to the estimators of growth. `noise` is the variance of the sensor
    /// noise in one value of the tooth period, (m/s²)².
    fn take_passing<const POINTS: usize, const BINS: usize>(
        &self,
        band: &mut BandState<POINTS, BINS>,
        passed: &Passed,
        noise: f32,
        look: Evaluation,
    ) {
        band.floor = math::sqrt(noise);
        band.since_passing_s = 0.0;
        let mut passing = passed.passing;
        if band.spoiled > 0 {
            band.spoiled -= 1;
            // That of a revolution ago is nearer to the truth.
            passing = band.growth.a_revolution_ago().unwrap_or(passing);
        }
        band.growth
            .push(passed.tooth, &passing, noise, self.settings.tool.teeth, look);
        if look >= Evaluation::Quick {
            // The detector gets a new finding only when the growth of the vibration was evaluated.
            band.passed = true;
            band.samples_since_growth = 0;
        }
    }
}
