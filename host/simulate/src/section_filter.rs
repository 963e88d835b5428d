//! The dynamics of a sensor along the simulated motion.

use super::effect::FirstOrderSection;

/// Readings of a sensor with dynamics: N signals that each pass the same first-order sections in series.
///
/// A section H(s) = (b₀ + b₁·s)/(1 + T·s) has one state w, T·ẇ = x − w, and the output y = (b₁/T)·x + (b₀ − b₁/T)·w.
/// Over a short interval the input x is taken as the parabola through its values at the ends and in the middle, for
/// which ẇ is integrated exactly.
#[derive(Clone, Debug)]
pub(crate) struct SectionFilter<const N: usize> {
    sections: Vec<FirstOrderSection>,
    /// By section: the state of each signal.
    states: Vec<[f64; N]>,
    /// Time up to which the states are integrated, s.
    pub(crate) until_s: f64,
}

impl<const N: usize> SectionFilter<N> {
    /// The sections at t = 0, with signals that have been at rest at `x`.
    pub(crate) fn at_rest(sections: &[FirstOrderSection], x: [f64; N]) -> Self {
        let mut x = x;
        let states = sections
            .iter()
            .map(|section| {
                let state = x;
                x = x.map(|value| section.static_gain * value);
                state
            })
            .collect();
        Self {
            sections: sections.to_vec(),
            states,
            until_s: 0.0,
        }
    }

    /// Integrates over an interval of `duration_s`, s, in which the input has the values `start`, `middle` and `end`;
    /// returns the output at the end.
    pub(crate) fn pass(&mut self, duration_s: f64, [start, middle, end]: [[f64; N]; 3]) -> [f64; N] {
        self.until_s += duration_s;
        std::array::from_fn(|signal| {
            let mut x = [start[signal], middle[signal], end[signal]];
            for (section, states) in self.sections.iter().zip(&mut self.states) {
                x = pass(section, &mut states[signal], duration_s, x);
            }
            x[2]
        })
    }
}

/// Input `x` and returned output at start, middle and end of an interval of `duration_s`, s; `w` is the state,
/// integrated to the end. Without a positive duration it stays.
fn pass(section: &FirstOrderSection, w: &mut f64, duration_s: f64, x: [f64; 3]) -> [f64; 3] {
    let feedthrough = section.derivative_s / section.time_constant_s;
    let output = |x: f64, w: f64| feedthrough * x + (section.static_gain - feedthrough) * w;
    let before = *w;
    if duration_s <= 0.0 {
        return x.map(|x| output(x, before));
    }
    // x = x₀ + c₁·u + c₂·u² for u from 0 to 1. The particular solution is a parabola too: κ·dw/du = x − w with κ =
    // T/duration.
    let quadratic = 2.0 * (x[0] + x[2] - 2.0 * x[1]);
    let linear = x[2] - x[0] - quadratic;
    let kappa = section.time_constant_s / duration_s;
    let slope = linear - 2.0 * kappa * quadratic;
    let constant = x[0] - kappa * slope;
    let state = |u: f64| constant + u * (slope + u * quadratic) + (before - constant) * (-u / kappa).exp();
    let middle = state(0.5);
    *w = state(1.0);
    [output(x[0], before), output(x[1], middle), output(x[2], *w)]
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use num_complex::Complex64;

    use super::*;

    #[test]
    fn a_tone_passes_with_the_transfer_function() {
        let sections = [
            FirstOrderSection::low_pass(2e-3),
            FirstOrderSection {
                static_gain: 0.0,
                derivative_s: 0.05,
                time_constant_s: 0.05,
            },
        ];
        let omega = TAU * 120.0;
        let signal = |t: f64| [(omega * t).sin(), 3.0 * (omega * t).cos()];
        let mut filter = SectionFilter::at_rest(&sections, signal(0.0));
        let step_s = 2e-4;
        let mut last = [0.0; 2];
        // One second is 20 of the longer time constant: the transient falls to e⁻²⁰.
        for k in 0..5000 {
            let t = f64::from(k) * step_s;
            last = filter.pass(step_s, [t, t + 0.5 * step_s, t + step_s].map(signal));
        }
        let h: Complex64 = sections
            .iter()
            .map(|section| section.at(Complex64::new(0.0, omega)))
            .product();
        let tone = h * Complex64::cis(omega * filter.until_s);
        assert!((last[0] - tone.im).abs() < 1e-4, "{last:?} {tone}");
        assert!((last[1] - 3.0 * tone.re).abs() < 3e-4, "{last:?} {tone}");
    }

    #[test]
    fn a_signal_at_rest_stays_at_rest_for_any_time_constant() {
        for time_constant_s in [1e-9, 1e-3, 1e3] {
            let sections = [FirstOrderSection::low_pass(time_constant_s)];
            let mut filter = SectionFilter::at_rest(&sections, [0.7]);
            for _ in 0..100 {
                let [y] = filter.pass(1e-4, [[0.7]; 3]);
                assert!((y - 0.7).abs() < 1e-12, "{time_constant_s} {y}");
            }
        }
    }
}
