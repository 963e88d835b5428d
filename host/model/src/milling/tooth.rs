//! Geometry of one tooth: from the immersion angle to the chip-thickness direction and the force directions (thesis eqs
//! 3.1 and 3.4).
//!
//! At the immersion angle φ, in feed, normal and axial direction, with the edge angle γ:
//!
//!   radial direction, outwards   o = (sin φ, cos φ, 0)
//!   tangential force             t = (−cos φ, sin φ, 0)
//!   chip-thickness direction     n = o·sin γ − e_z·cos γ
//!   force                        F = F_t·t − (F_r·sin γ + F_a·cos γ)·o + (F_r·cos γ − F_a·sin γ)·e_z
//!
//! Each of these vectors, the force at constant F_t, F_r and F_a, is a constant plus a linear function of (sin φ, cos
//! φ). A [`RotatingVector`](super::RotatingVector) holds the coefficients of one such vector.

/// Sine and radial direction at one immersion angle φ.
#[derive(Clone, Copy, Debug)]
pub struct Immersion {
    /// sin φ: component of a unit feed along the radial direction, outwards.
    pub sin: f64,
    /// Unit vector o radially outwards: in feed and normal direction, or in the machine's x and y.
    pub outward: [f64; 2],
}

impl Immersion {
    /// Sine and radial direction at the immersion angle `phi_rad`, rad, in feed and normal direction.
    pub fn new(phi_rad: f64) -> Self {
        let (sin, cos) = phi_rad.sin_cos();
        Self {
            sin,
            outward: [sin, cos],
        }
    }

    /// The same immersion with the radial direction in the machine's x and y; `[a, b]` is the unit vector of the feed
    /// in these axes.
    pub(crate) fn in_machine(self, [a, b]: [f64; 2]) -> Self {
        let [sin, cos] = self.outward;
        Self {
            outward: [sin * a - cos * b, sin * b + cos * a],
            ..self
        }
    }
}

/// Edge angle γ of the teeth, between the cutting edge and the plane normal to the tool axis: 90° for a square end mill.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EdgeAngle {
    degrees: f64,
    sin: f64,
    cos: f64,
}

impl EdgeAngle {
    /// An edge angle in degrees. Sine and cosine of 90 degrees are exact: axial vibration then has no influence on the
    /// chip thickness.
    pub fn new(degrees: f64) -> Self {
        let (sin, cos) = if degrees == 90.0 {
            (1.0, 0.0)
        } else {
            degrees.to_radians().sin_cos()
        };
        Self { degrees, sin, cos }
    }

    /// γ in degrees.
    pub fn degrees(self) -> f64 {
        self.degrees
    }

    /// sin γ.
    pub fn sin(self) -> f64 {
        self.sin
    }

    /// True if an axial displacement changes the chip thickness: γ differs from 90 degrees.
    pub fn sees_axial_displacement(self) -> bool {
        self.cos != 0.0
    }

    /// Chip-thickness direction n.
    pub fn normal(self, at: Immersion) -> [f64; 3] {
        [at.outward[0] * self.sin, at.outward[1] * self.sin, -self.cos]
    }

    /// Position of an edge along the chip thickness, m, at the displacement `x`, m, of a tool whose tooth has the
    /// radial runout r = `radial_m`, m: n·x + r·sin γ, thesis eq. 3.1 without feed.
    pub fn reach_m(self, at: Immersion, radial_m: f64, x: [f64; 3]) -> f64 {
        let outward = at.outward[0] * x[0] + at.outward[1] * x[1];
        (outward + radial_m) * self.sin - x[2] * self.cos
    }

    /// Contribution f·sin φ·sin γ of the feed f = `feed_m`, m, to the chip thickness, m.
    pub fn recession_m(self, at: Immersion, feed_m: f64) -> f64 {
        feed_m * at.sin * self.sin
    }

    /// Force on an edge in the directions of [`EdgeForce`], from the tangential, radial and axial component of the
    /// force law.
    pub fn force(self, [tangential, radial, axial]: [f64; 3]) -> EdgeForce {
        EdgeForce {
            tangential,
            inward: radial * self.sin + axial * self.cos,
            axial: radial * self.cos - axial * self.sin,
        }
    }

    /// Directions (n − μ·t)·nᵀ of process damping, rows force, columns velocity. Minus this matrix times the velocity v
    /// is the force on the flank for a unit coefficient: −(n·v)·n, and the friction μ·(n·v)·t.
    pub fn flank(self, friction: f64, at: Immersion) -> [[f64; 3]; 3] {
        let normal = self.normal(at);
        let force = self.force([friction, 1.0, 0.0]).at(at);
        force.map(|force| normal.map(|normal| -force * normal))
    }
}

/// Force on an edge by components along tangential direction, tool radius and tool axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EdgeForce {
    /// Tangential component, against the cutting motion of the tooth.
    pub tangential: f64,
    /// Component towards the tool axis.
    pub inward: f64,
    /// Component along the tool axis.
    pub axial: f64,
}

impl EdgeForce {
    /// Force vector on the tool at an immersion, in the unit of the components: in feed, normal and axial direction, or
    /// in the machine's x, y, z, as `at` is given.
    pub fn at(self, at: Immersion) -> [f64; 3] {
        let [x, y] = at.outward;
        [
            -self.tangential * y - self.inward * x,
            self.tangential * x - self.inward * y,
            self.axial,
        ]
    }

    /// True if all three components are zero.
    pub fn is_zero(self) -> bool {
        self.tangential == 0.0 && self.inward == 0.0 && self.axial == 0.0
    }
}
