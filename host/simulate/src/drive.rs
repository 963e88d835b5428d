//! A force from outside on the tool.

/// A force from outside on the tool: a shaker.
pub trait Drive: Send + Sync {
    /// The force at `t`, N, in the machine's x, y, z. It is never asked for within a billionth of a step of a knot.
    fn force_n(&self, t: f64) -> [f64; 3];

    /// How much less the force is per velocity of the tool, N s/m: a shaker's armature generates a voltage against its
    /// drive as it moves, so that the force drops where the structure resonates.
    fn drop_ns_per_m(&self) -> [f64; 3] {
        [0.0; 3]
    }

    /// The first time after `t` at which the force or one of its lower derivatives jumps.
    fn next_knot_s(&self, _t: f64) -> f64 {
        f64::INFINITY
    }

    /// The longest step in which the force is not missed: nothing else shortens steps while friction holds the tool.
    fn longest_step_s(&self) -> f64 {
        f64::INFINITY
    }
}
