//! Restoring forces in addition to the linear structure.

/// Largest number of state variables of a structure and its laws.
pub(crate) const ROOM: usize = 16;

/// State vector: q, q̇ and the internal states of the laws.
pub(crate) type State = [f64; ROOM];

/// A restoring force f_r in addition to the linear structure: M q̈ + C q̇ + K q + Bᵀf_r = Bᵀ F.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Law {
    /// Nonlinear spring: c_n·u^n.
    Spring {
        axis: usize,
        power: i32,
        coefficient: f64,
    },
    /// Nonlinear damper: c_n·v^n.
    Damper {
        axis: usize,
        power: i32,
        coefficient: f64,
    },
    /// Quadratic damper: c_2·|v|·v.
    QuadraticDamper { axis: usize, coefficient: f64 },
    /// Stribeck friction: kinetic·sign(v)·(1 + (breakaway/kinetic − 1)·e^(−(v/v_s)²)); while it sticks, any force within ±breakaway.
    Friction {
        axis: usize,
        kinetic_n: f64,
        breakaway_n: f64,
        stribeck_m_per_s: f64,
    },
    /// Backlash: a spring without force within ±half_gap. f_r is minus the part of the linear spring's force that is missing.
    Gap {
        axis: usize,
        half_gap_m: f64,
        stiffness: f64,
    },
    /// Bouc–Wen hysteresis of exponent 1 with γ = β = ½. Its internal state z is number `own` of the state vector.
    BoucWen {
        axis: usize,
        stiffness: f64,
        yield_m: f64,
        own: usize,
    },
    /// A joint of sliders, number `sliders` of the system.
    Joint { axis: usize, sliders: usize },
    /// Mode coupling: the derivatives of the potential ½·k·x²·y².
    Coupling { axes: [usize; 2], coefficient: f64 },
    /// Drift of the stiffness: r·t·K·u.
    Drift {
        stiffness: [[f64; 3]; 3],
        rate_per_s: f64,
    },
    /// Pulsating stiffness: k·cos(ωt)·u.
    Pulsating { axis: usize, stiffness: f64, omega: f64 },
    /// Stop on one side: k·(u − gap) beyond the gap.
    Stop { axis: usize, gap_m: f64, stiffness: f64 },
    /// An unmeasured periodic force: −F·cos(ωt + φ).
    UnmeasuredForce {
        axis: usize,
        amplitude_n: f64,
        omega: f64,
        phase: f64,
    },
}

/// Number of the smooth branch of a law that holds at present.
pub(crate) type Branch = i8;

/// Signs of v and z in a branch of the Bouc–Wen law.
pub(crate) fn signs(branch: Branch) -> (f64, f64) {
    (
        if branch & 1 == 0 { 1.0 } else { -1.0 },
        if branch & 2 == 0 { 1.0 } else { -1.0 },
    )
}

impl Law {
    /// True for a law with more than one smooth branch.
    pub(crate) fn switches(&self) -> bool {
        matches!(
            self,
            Self::Friction { .. }
                | Self::Gap { .. }
                | Self::BoucWen { .. }
                | Self::Joint { .. }
                | Self::Stop { .. }
        )
    }

    /// The restoring force f_r along x, y, z, N; zero for a joint, whose force depends on its sliders.
    pub(crate) fn restoring(&self, t: f64, u: [f64; 3], v: [f64; 3], y: &State, branch: Branch) -> [f64; 3] {
        let mut force = [0.0; 3];
        match *self {
            Self::Spring {
                axis,
                power,
                coefficient,
            } => force[axis] = coefficient * u[axis].powi(power),
            Self::Damper {
                axis,
                power,
                coefficient,
            } => force[axis] = coefficient * v[axis].powi(power),
            Self::QuadraticDamper { axis, coefficient } => {
                force[axis] = coefficient * v[axis].abs() * v[axis];
            }
            Self::Friction {
                axis,
                kinetic_n,
                breakaway_n,
                stribeck_m_per_s,
            } => {
                let more = (breakaway_n - kinetic_n) * (-(v[axis] / stribeck_m_per_s).powi(2)).exp();
                force[axis] = f64::from(branch) * (kinetic_n + more);
            }
            Self::Gap {
                axis,
                half_gap_m,
                stiffness,
            } => {
                let missing = if branch == 0 {
                    u[axis]
                } else {
                    f64::from(branch) * half_gap_m
                };
                force[axis] = -stiffness * missing;
            }
            Self::BoucWen {
                axis, stiffness, own, ..
            } => force[axis] = stiffness * (y[own] - u[axis]),
            Self::Coupling {
                axes: [a, b],
                coefficient,
            } => {
                force[a] = coefficient * u[a] * u[b] * u[b];
                force[b] = coefficient * u[a] * u[a] * u[b];
            }
            Self::Drift {
                stiffness,
                rate_per_s,
            } => {
                for (force, row) in force.iter_mut().zip(stiffness) {
                    *force = rate_per_s * t * (row[0] * u[0] + row[1] * u[1] + row[2] * u[2]);
                }
            }
            Self::Pulsating {
                axis,
                stiffness,
                omega,
            } => force[axis] = stiffness * (omega * t).cos() * u[axis],
            Self::Stop {
                axis,
                gap_m,
                stiffness,
            } => {
                if branch == 1 {
                    force[axis] = stiffness * (u[axis] - gap_m);
                }
            }
            Self::UnmeasuredForce {
                axis,
                amplitude_n,
                omega,
                phase,
            } => force[axis] = -amplitude_n * (omega * t + phase).cos(),
            Self::Joint { .. } => {}
        }
        force
    }
}
