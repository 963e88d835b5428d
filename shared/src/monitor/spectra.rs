//! The spectra of both bands, and the spindle speed that is read from them.

use super::band_state::follow_tone;
use super::pipeline::Monitor;
use super::state::State;
use crate::decimation::{STRUCTURE_BAND, TOOL_BAND};
use crate::peaks::Rotation;
use crate::spectrum::{PowerSpectrum, structure_spectrum, tool_spectrum};
use crate::units::Hertz;

/// An assumed speed is believed to this part,
const ASSUMED_UNCERTAINTY: f32 = 0.005;
/// one that was measured to this,
const MEASURED_UNCERTAINTY: f32 = 5e-4;
/// and one that was heard at the tooth passing to this part of a bin.
const HEARD_BINS: f32 = 0.2;
/// A tooth-passing tone stands out of the noise by this factor of power at least to be believed.
const HEARD_SNR: f32 = 100.0;
/// Spectra are summed over all axes.
const AXES: [usize; 3] = [0, 1, 2];
/// Where tones are looked for.
const STRUCTURE_TONES: (Hertz, Hertz) = (Hertz(5.0), STRUCTURE_BAND);
const TOOL_TONES: (Hertz, Hertz) = (Hertz(150.0), TOOL_BAND);

impl Monitor {
    /// Spectra that are due, the background, and the tones in them.
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
                state.heard_speed = self.hear_speed(&spectrum);
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
            state.heard_speed = None;
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

    /// Revolutions per second read from a tone at the tooth passing near the assumed one.
    fn hear_speed(&self, spectrum: &PowerSpectrum<'_>) -> Option<Hertz> {
        let assumed = self.settings.assumed_speed?.to_hertz().0 * f32::from(self.settings.tool.teeth);
        let reach = ASSUMED_UNCERTAINTY * assumed + spectrum.bin.0;
        let peak = spectrum.dominant(Hertz(assumed - reach), Hertz(assumed + reach))?;
        let near = (peak.frequency.0 - assumed).abs() < reach;
        (near && peak.snr > HEARD_SNR)
            .then_some(Hertz(peak.frequency.0 / f32::from(self.settings.tool.teeth)))
    }

    /// What the spindle does, with its uncertainty.
    fn rotation(&self, state: &State, measured: Option<Hertz>) -> Option<Rotation> {
        let with = |frequency: Hertz, uncertainty: f32| Rotation {
            frequency,
            uncertainty: Hertz(uncertainty),
        };
        if let Some(measured) = measured {
            return Some(with(measured, MEASURED_UNCERTAINTY * measured.0));
        }
        if let Some(heard) = state.heard_speed {
            return Some(with(
                heard,
                HEARD_BINS * state.tool.bin.0 / f32::from(self.settings.tool.teeth),
            ));
        }
        let assumed = self.settings.assumed_speed?.to_hertz();
        Some(with(assumed, ASSUMED_UNCERTAINTY * assumed.0))
    }
}
