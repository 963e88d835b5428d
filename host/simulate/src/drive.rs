//! External excitation force on the tool.

/// An external excitation force on the tool, such as that of a shaker or a hammer.
pub trait Drive: Send + Sync {
    /// The commanded force at the time `t`, N, in the machine's x, y, z. The integrator does not evaluate it closer to
    /// a knot ([`Self::next_knot_s`]) than 1e-9 of the length of a step.
    fn force_n(&self, t: f64) -> [f64; 3];

    /// Force drop per velocity of the tool along x, y and z, N s/m: the back-EMF of a shaker without force control
    /// reduces the force at resonance.
    fn drop_ns_per_m(&self) -> [f64; 3] {
        [0.0; 3]
    }

    /// The first time after `t`, s, at which the excitation force or one of its low-order time derivatives is
    /// discontinuous (a knot); infinite if there is none.
    fn next_knot_s(&self, _t: f64) -> f64 {
        f64::INFINITY
    }

    /// The longest integration step that resolves the force, s. While friction sticks or the tool is at rest, error
    /// control does not limit the step; this length then does.
    fn longest_step_s(&self) -> f64 {
        f64::INFINITY
    }
}
