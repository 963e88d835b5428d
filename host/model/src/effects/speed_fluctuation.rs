//! The spindle speed is modulated, the feed rate is not: Ω = Ω₀·(1 + δ·sin(2πf_m·t + ψ)).

use std::sync::Arc;

use super::{Class, Effect, EffectName, EffectSpec, Locations, Parameter, Prior, Treatment};
use crate::{Fluctuation, Spindle};

/// The specification.
pub(super) const SPEED_FLUCTUATION: EffectSpec = EffectSpec {
    id: EffectName::SpeedFluctuation,
    name: "speed-fluctuation",
    class: Class::Spindle,
    locations: Locations::Cut,
    parameters: &[
        Parameter::number("delta", "", "relative amplitude of the speed modulation, δ")
            .main()
            .within(BELOW_ONE),
        Parameter::number("frequency_hz", "Hz", "modulation frequency, f_m").within(Prior::POSITIVE),
        Parameter::number(
            "phase_deg",
            "°",
            "phase at the start of the record, ψ; 0 without the key",
        ),
    ],
    treatment: Treatment::Refused(
        "the tooth period then changes from tooth to tooth, and there is no one-period map; `simulate` runs it, and without \
         the table the limits are those of the mean speed",
    ),
    candidates: &["the modulation that is nearest to the edges of the tachometer"],
    shares_term_with: &[],
    summary: "the spindle speed is modulated",
    equation: "Ω = Ω₀·(1 + δ·sin(2πf_m·t + ψ))",
    shows: "the tachometer, and side lines of the tooth lines at ±f_m",
    hidden_by: "recordings without a tachometer, where drift of the structure does the same",
    source: "Sexton, Milne and Stone (1977); Insperger and Stépán, J. Vib. Control 10 (2004)",
    example: "delta = 0.01\nfrequency_hz = 2.0\nphase_deg = 45.0",
    describing_function: None,
    build: |values| {
        Ok(Arc::new(SpeedFluctuation(Fluctuation {
            delta: values.main("delta")?,
            frequency_hz: values.needed("frequency_hz")?,
            phase_rad: values.number("phase_deg")?.unwrap_or(0.0).to_radians(),
        })))
    },
};

/// Bounds of the relative amplitude δ, themselves excluded: at a bound the spindle would stop for an instant in each
/// modulation period, beyond it would rotate backwards at times.
const BELOW_ONE: Prior = Prior::open(-1.0, 1.0, "a number between -1 and 1");

#[derive(Clone, Copy, Debug)]
struct SpeedFluctuation(Fluctuation);

impl Effect for SpeedFluctuation {
    fn id(&self) -> EffectName {
        EffectName::SpeedFluctuation
    }

    fn alter_spindle(&self, spindle: &mut Spindle) {
        *spindle = spindle.fluctuating(self.0);
    }
}
