//! The spectra of both bands, their tones, and the spindle speed estimated from them.

use super::band_state::{BandState, follow_tone};
use super::pipeline::Monitor;
use super::state::State;
use crate::criteria::{
    ASSUMED_SPEED_UNCERTAINTY, MEASURED_SPEED_UNCERTAINTY, SPEED_TONE_BINS, SPEED_TONE_SNR,
};
use crate::decimation::{STRUCTURE_BAND, TOOL_BAND};
use crate::detector::lines::Lines;
use crate::peaks::{Peak, Rotation};
use crate::spectrum::{HANN_NOISE_BINS, PowerSpectrum, structure_spectrum, tool_spectrum};
use crate::units::Hertz;

/// Axes over which the power spectra are summed: all three.
const AXES: [usize; 3] = [0, 1, 2];
/// Frequency range in which tones are searched in the structure band.
const STRUCTURE_TONES: (Hertz, Hertz) = (Hertz(5.0), STRUCTURE_BAND);
/// Frequency range in which tones are searched in the tool band.
const TOOL_TONES: (Hertz, Hertz) = (Hertz(150.0), TOOL_BAND);

impl Monitor {
    /// Computes the spectra of the bands that have a complete block of samples. Updates tracked tone and background
    /// spectrum of these bands, and the spindle speed estimated from the tool band.
    pub(super) fn take_spectra(&self, state: &mut State, measured: Option<Hertz>) {
        let rate = state
            .sample_clock
            .rate()
            .unwrap_or(self.settings.sensor.nominal_rate);
        let unit = self.unit();
        let chatter = state.detector.is_chatter();
        if state.tool.fresh {
            let band_rate = Hertz(rate.0 / self.decimation.tool_divisor() as f32);
            let band = &mut state.tool;
            let spectrum = tool_spectrum(
                &band.overlap,
                &AXES,
                band_rate,
                unit,
                &mut state.tool_work,
                &mut band.power,
            );
            band.bin = spectrum.bin;
            if measured.is_none() {
                state.tone_speed = self.speed_from_tone(&spectrum);
            }
        }
        if state.structure.fresh {
            let band_rate = Hertz(rate.0 / self.decimation.structure_divisor() as f32);
            let band = &mut state.structure;
            let spectrum = structure_spectrum(
                &band.overlap,
                &AXES,
                band_rate,
                unit,
                &mut state.work,
                &mut band.power,
            );
            band.bin = spectrum.bin;
        }
        if measured.is_some() {
            state.tone_speed = None;
        }
        let rotation = self.rotation(state, measured);
        // Samples at fixed angles tell more than lines.
        let nominal = rotation.filter(|_| measured.is_none());
        if state.tool.fresh {
            self.follow_lines(&mut state.tool, nominal, TOOL_TONES);
        }
        if state.structure.fresh {
            self.follow_lines(&mut state.structure, nominal, STRUCTURE_TONES);
        }
        let noise = |bin: Hertz| AXES.len() as f32 * self.noise_density() * HANN_NOISE_BINS * bin.0;
        if state.tool.fresh {
            let noise = noise(state.tool.bin);
            follow_tone(
                &mut state.tool,
                rotation,
                TOOL_TONES,
                chatter,
                noise,
                &mut state.work,
            );
        }
        if state.structure.fresh {
            let noise = noise(state.structure.bin);
            follow_tone(
                &mut state.structure,
                rotation,
                STRUCTURE_TONES,
                chatter,
                noise,
                &mut state.work,
            );
        }
    }

    /// Finds the lines of a spindle, whose speed is not measured, in the new spectrum of a band.
    fn follow_lines<const POINTS: usize, const BINS: usize>(
        &self,
        band: &mut BandState<POINTS, BINS>,
        nominal: Option<Rotation>,
        range: (Hertz, Hertz),
    ) {
        let spectrum = PowerSpectrum {
            power: &band.power,
            bin: band.bin,
        };
        band.lines = nominal.map(|rotation| {
            let teeth = self.settings.tool.teeth;
            Lines::follow(band.lines.as_ref(), &spectrum, rotation, teeth, range)
        });
    }

    /// Rotation of the spindle from the tones of the spectrum near the harmonics of the assumed tooth-passing frequency; `None` if no
    /// spindle speed is assumed or no tone near the first harmonic is strong enough. Each further harmonic that is found makes it sharper.
    fn speed_from_tone(&self, spectrum: &PowerSpectrum<'_>) -> Option<Rotation> {
        let teeth = f32::from(self.settings.tool.teeth);
        let assumed = self.settings.assumed_speed?.to_hertz();
        let mut rotation = Rotation {
            frequency: assumed,
            uncertainty: Hertz(ASSUMED_SPEED_UNCERTAINTY * assumed.0),
        };
        for harmonic in [1.0, 2.0, 4.0, 8.0] {
            let orders = harmonic * teeth;
            let expected = orders * rotation.frequency.0;
            let reach = orders * rotation.uncertainty.0 + spectrum.bin.0;
            let found = spectrum.dominant(Hertz(expected - reach), Hertz(expected + reach));
            let near = |peak: &Peak| (peak.frequency.0 - expected).abs() < reach && peak.snr > SPEED_TONE_SNR;
            let Some(peak) = found.filter(near) else {
                return (harmonic > 1.0).then_some(rotation);
            };
            let uncertainty = SPEED_TONE_BINS * spectrum.bin.0 / orders;
            if uncertainty < rotation.uncertainty.0 {
                rotation = Rotation {
                    frequency: Hertz(peak.frequency.0 / orders),
                    uncertainty: Hertz(uncertainty),
                };
            }
        }
        Some(rotation)
    }

    /// Spindle speed with its uncertainty: measured by the tachometer, else from the spectrum, else assumed; `None` if
    /// none of these is available.
    fn rotation(&self, state: &State, measured: Option<Hertz>) -> Option<Rotation> {
        let with = |frequency: Hertz, uncertainty: f32| Rotation {
            frequency,
            uncertainty: Hertz(uncertainty),
        };
        if let Some(measured) = measured {
            return Some(with(measured, MEASURED_SPEED_UNCERTAINTY * measured.0));
        }
        if let Some(from_tone) = state.tone_speed {
            return Some(from_tone);
        }
        let assumed = self.settings.assumed_speed?.to_hertz();
        Some(with(assumed, ASSUMED_SPEED_UNCERTAINTY * assumed.0))
    }
}
