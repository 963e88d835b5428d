//! Samples of both bands, taken towards spectra and at fixed angles.

use super::Band;
use super::angles::Angles;
use super::band_state::BandState;
use super::pipeline::Monitor;
use super::state::State;
use super::strobe::show;
use crate::decimation::Sample;
use crate::detector::growth::Look;
use crate::math;
use crate::spectrum::{STRUCTURE_POINTS, TOOL_POINTS};
use crate::synchronous::{Method, Passed, SLOTS, Sampler};

/// Samples of a band from one spectrum to the next.
const TOOL_HOP: usize = TOOL_POINTS / 2;
const STRUCTURE_HOP: usize = STRUCTURE_POINTS / 4;
/// A tooth period must have so many samples of a band to be sampled at fixed angles.
const STRUCTURE_SAMPLES_PER_TOOTH: f32 = 8.0;
const TOOL_SAMPLES_PER_TOOTH: f32 = 2.5;
/// The angle must be known to this part of a tooth period.
const LARGEST_ANGLE_DEVIATION: f32 = 0.03;
/// In the tool band growth is looked at not more often than after so many of its samples, 4 ms: what it costs.
const LOOK_SAMPLES: u32 = 53;

impl Monitor {
    /// Whether samples of a band can be taken at fixed angles.
    fn can_sample(&self, angles: &Angles, divisor: u32, least: f32) -> bool {
        angles.samples_per_tooth >= least * divisor as f32 && angles.deviation < LARGEST_ANGLE_DEVIATION
    }

    pub(super) fn take_tool(&self, state: &mut State, sample: Sample, n: usize, angles: Option<&Angles>) {
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
        let angle = angles.at(n, self.decimation.tool_delay());
        let unit = self.unit();
        let Some(passed) = sampler.step(&mut band.sampler, sample.map(|x| x as f32 * unit), angle) else {
            return;
        };
        let rate = self.settings.sensor.nominal_rate.0 / self.decimation.tool_divisor() as f32;
        let noise = self.noise_density() * 0.5 * rate;
        // Not closely: samples between the samples are as good as a cubic, and what that leaves of the forced vibration turns by the samples per
        // tooth period, a tone that beats with its own harmonics.
        let look = if band.since_look >= LOOK_SAMPLES {
            Look::Quick
        } else {
            Look::None
        };
        self.take_passing(band, &passed, noise, look);
        // Slower teeth than the structure band needs are shown from there.
        if !self.can_sample(
            angles,
            self.decimation.structure_divisor(),
            STRUCTURE_SAMPLES_PER_TOOTH,
        ) {
            show(&mut state.strobes, Band::Tool, &passed);
        }
    }

    pub(super) fn take_structure(
        &self,
        state: &mut State,
        sample: Sample,
        n: usize,
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
        let angle = angles.at(n, self.decimation.structure_delay());
        let unit = self.unit();
        let Some(passed) = sampler.step(&mut band.sampler, sample.map(|x| x as f32 * unit), angle) else {
            return;
        };
        // A mean over w seconds lets 1/(2w) Hz of the noise through.
        let rate = self.settings.sensor.nominal_rate.0;
        let bandwidth = 0.5 * rate * SLOTS as f32 / angles.samples_per_tooth;
        let noise = self.noise_density() * bandwidth.min(0.5 * rate / divisor as f32);
        self.take_passing(band, &passed, noise, Look::Close);
        show(&mut state.strobes, Band::Structure, &passed);
    }

    fn take_passing<const POINTS: usize, const BINS: usize>(
        &self,
        band: &mut BandState<POINTS, BINS>,
        passed: &Passed,
        noise: f32,
        look: Look,
    ) {
        band.floor = math::sqrt(noise);
        band.growth.push(
            passed.tooth,
            &passed.passing,
            noise,
            self.settings.tool.teeth,
            look,
        );
        if look >= Look::Quick {
            // Without a look there is nothing new to judge.
            band.passed = true;
            band.since_look = 0;
        }
    }
}
