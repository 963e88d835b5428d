//! The spectra of both bands, their tones, and the spindle speed estimated from them.

use super::band_state::follow_tone;
use super::pipeline::Monitor;
use super::state::State;
use crate::criteria::{
    ASSUMED_SPEED_UNCERTAINTY, MEASURED_SPEED_UNCERTAINTY, SPEED_TONE_BINS, SPEED_TONE_SNR,
};
use crate::decimation::{STRUCTURE_BAND, TOOL_BAND};
use crate::peaks::Rotation;
use crate::spectrum::{PowerSpectrum, structure_spectrum, tool_spectrum};
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
        if state.tool.fresh {
            follow_tone(&mut state.tool, rotation, TOOL_TONES, chatter, &mut state.work);
        }
        if state.structure.fresh {
            follow_tone(
                &mut state.structure,
                rotation,
                STRUCTURE_TONES,
                chatter,
                &mut state.work,
            );
        }
    }

    /// Spindle speed in revolutions per second, from the strongest tone of the spectrum near the assumed
    /// tooth-passing frequency; `None` if no spindle speed is assumed or no tone there is strong enough.
    fn speed_from_tone(&self, spectrum: &PowerSpectrum<'_>) -> Option<Hertz> {
        let assumed = self.settings.assumed_speed?.to_hertz().0 * f32::from(self.settings.tool.teeth);
        let reach = ASSUMED_SPEED_UNCERTAINTY * assumed + spectrum.bin.0;
        let peak = spectrum.dominant(Hertz(assumed - reach), Hertz(assumed + reach))?;
        let near = (peak.frequency.0 - assumed).abs() < reach;
        (near && peak.snr > SPEED_TONE_SNR)
            .then_some(Hertz(peak.frequency.0 / f32::from(self.settings.tool.teeth)))
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
            return Some(with(
                from_tone,
                SPEED_TONE_BINS * state.tool.bin.0 / f32::from(self.settings.tool.teeth),
            ));
        }
        let assumed = self.settings.assumed_speed?.to_hertz();
        Some(with(assumed, ASSUMED_SPEED_UNCERTAINTY * assumed.0))
    }
}
