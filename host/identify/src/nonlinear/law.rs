//! Equations of motion that are linear in their unknown parameters.

/// Equation of motion Σ_p θ_p φ_p(q, q̇, q̈) = F with parameters θ_p and regressors φ_p, and one row per degree of
/// freedom.
#[derive(Clone, Debug, PartialEq)]
pub struct Law {
    /// Number n of degrees of freedom of the equation of motion.
    pub dofs: usize,
    /// The parameters of the equation of motion in the order of θ.
    pub parameters: Vec<Parameter>,
}

/// One parameter of an equation of motion and its regressor.
#[derive(Clone, Debug, PartialEq)]
pub struct Parameter {
    /// Meaning of the parameter.
    pub role: Role,
    /// Regressor φ_p of the parameter, a sum of monomials.
    pub terms: Vec<Monomial>,
}

/// Meaning of a parameter of an equation of motion. Indices are degrees of freedom.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Role {
    /// M_ij, kg.
    Mass(usize, usize),
    /// C_ij, N s/m.
    Damping(usize, usize),
    /// K_ij, N/m.
    Stiffness(usize, usize),
    /// k2·x², N/m².
    QuadraticStiffness(usize),
    /// k3·x³, N/m³.
    CubicStiffness(usize),
    /// k5·x⁵, N/m⁵.
    QuinticStiffness(usize),
    /// c3·v³, N s³/m³.
    CubicDamping(usize),
    /// Potential ½·k·x²y² of two degrees of freedom, k in N/m³.
    QuarticCoupling(usize, usize),
    /// Potential k·x²y of two degrees of freedom, k in N/m².
    CubicCoupling(usize, usize),
}

impl Role {
    /// True for parameters of the linear terms: entries of the mass, damping and stiffness matrix.
    pub fn is_linear(self) -> bool {
        matches!(self, Self::Mass(..) | Self::Damping(..) | Self::Stiffness(..))
    }

    /// Key of the parameter in JSON answers and case files.
    pub fn key(self) -> &'static str {
        match self {
            Self::Mass(..) => "mass_kg",
            Self::Damping(..) => "damping_ns_per_m",
            Self::Stiffness(..) => "stiffness_n_per_m",
            Self::QuadraticStiffness(_) => "k2_n_per_m2",
            Self::CubicStiffness(_) => "k3_n_per_m3",
            Self::QuinticStiffness(_) => "k5_n_per_m5",
            Self::CubicDamping(_) => "c3_ns3_per_m3",
            Self::QuarticCoupling(..) => "kxyy_n_per_m3",
            Self::CubicCoupling(..) => "kxxy_n_per_m2",
        }
    }

    /// Degrees of freedom that the parameter acts on.
    pub fn dofs(self) -> Vec<usize> {
        match self {
            Self::Mass(i, j)
            | Self::Damping(i, j)
            | Self::Stiffness(i, j)
            | Self::QuarticCoupling(i, j)
            | Self::CubicCoupling(i, j) => {
                if i == j {
                    vec![i]
                } else {
                    vec![i, j]
                }
            }
            Self::QuadraticStiffness(i)
            | Self::CubicStiffness(i)
            | Self::QuinticStiffness(i)
            | Self::CubicDamping(i) => vec![i],
        }
    }
}

/// Term factor · Π u_k in one row of the equation of motion, with u = (q, q̇, q̈), each with an entry per degree of
/// freedom.
#[derive(Clone, Debug, PartialEq)]
pub struct Monomial {
    /// Row of the equation of motion that contains the term.
    pub row: usize,
    /// Constant factor.
    pub factor: f64,
    /// Indices into u = (q, q̇, q̈) of the factors of the monomial; an index may occur several times.
    pub factors: Vec<usize>,
}

/// Nonlinear terms that an equation of motion may contain in addition to mass, damping and stiffness.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, clap::ValueEnum)]
pub enum NonlinearTerm {
    /// k2·x² in every direction.
    QuadraticStiffness,
    /// k3·x³ in every direction.
    CubicStiffness,
    /// Spring force k3·x³ + k5·x⁵ in every direction.
    SofteningHardening,
    /// c3·v³ in every direction.
    CubicDamping,
    /// Potentials ½·k·x²y² and k·x²y for every pair of directions.
    ModeCoupling,
}

impl Law {
    /// Equation of motion with full symmetric matrices M, C, K of `dofs` degrees of freedom and the nonlinear terms of
    /// `extras`.
    pub fn new(dofs: usize, extras: &[NonlinearTerm]) -> Self {
        let mut parameters = Vec::new();
        type Make = fn(usize, usize) -> Role;
        let kinds: [(Make, usize); 3] = [(Role::Mass, 2), (Role::Damping, 1), (Role::Stiffness, 0)];
        for (role, derivative) in kinds {
            for i in 0..dofs {
                for j in i..dofs {
                    let entry = |row: usize, column: usize| Monomial {
                        row,
                        factor: 1.0,
                        factors: vec![derivative * dofs + column],
                    };
                    let mut terms = vec![entry(i, j)];
                    if i != j {
                        terms.push(entry(j, i));
                    }
                    parameters.push(Parameter {
                        role: role(i, j),
                        terms,
                    });
                }
            }
        }
        let power = |role: Role, u: usize, exponent: usize| Parameter {
            role,
            terms: vec![Monomial {
                row: u % dofs,
                factor: 1.0,
                factors: vec![u; exponent],
            }],
        };
        let has = |extra| extras.contains(&extra);
        for i in 0..dofs {
            if has(NonlinearTerm::QuadraticStiffness) {
                parameters.push(power(Role::QuadraticStiffness(i), i, 2));
            }
            if has(NonlinearTerm::CubicStiffness) || has(NonlinearTerm::SofteningHardening) {
                parameters.push(power(Role::CubicStiffness(i), i, 3));
            }
            if has(NonlinearTerm::SofteningHardening) {
                parameters.push(power(Role::QuinticStiffness(i), i, 5));
            }
            if has(NonlinearTerm::CubicDamping) {
                parameters.push(power(Role::CubicDamping(i), dofs + i, 3));
            }
        }
        if has(NonlinearTerm::ModeCoupling) {
            for i in 0..dofs {
                for j in i + 1..dofs {
                    parameters.extend(couplings(i, j));
                }
            }
        }
        Self { dofs, parameters }
    }

    /// Largest polynomial degree of the terms of the equation of motion.
    pub fn degree(&self) -> usize {
        let monomials = self.parameters.iter().flat_map(|parameter| &parameter.terms);
        monomials
            .map(|monomial| monomial.factors.len())
            .max()
            .unwrap_or(1)
    }

    /// Index in θ of the parameter with this role; `None` if the equation of motion does not have it.
    pub fn index(&self, role: Role) -> Option<usize> {
        self.parameters
            .iter()
            .position(|parameter| parameter.role == role)
    }
}

fn couplings(i: usize, j: usize) -> [Parameter; 3] {
    let term = |row: usize, factor: f64, factors: Vec<usize>| Monomial { row, factor, factors };
    [
        Parameter {
            role: Role::QuarticCoupling(i, j),
            terms: vec![term(i, 1.0, vec![i, j, j]), term(j, 1.0, vec![i, i, j])],
        },
        Parameter {
            role: Role::CubicCoupling(i, j),
            terms: vec![term(i, 2.0, vec![i, j]), term(j, 1.0, vec![i, i])],
        },
        Parameter {
            role: Role::CubicCoupling(j, i),
            terms: vec![term(j, 2.0, vec![i, j]), term(i, 1.0, vec![j, j])],
        },
    ]
}

impl Monomial {
    /// Value of the monomial at u = (q, q̇, q̈).
    pub fn value(&self, u: &[f64]) -> f64 {
        self.factors
            .iter()
            .fold(self.factor, |product, &k| product * u[k])
    }

    /// Adds `weight` times the derivatives of the monomial by the entries of u = (q, q̇, q̈) to `partials`.
    pub fn add_partials(&self, weight: f64, u: &[f64], partials: &mut [f64]) {
        for (place, &k) in self.factors.iter().enumerate() {
            let others = self
                .factors
                .iter()
                .enumerate()
                .filter(|(other, _)| *other != place)
                .fold(self.factor, |product, (_, &k)| product * u[k]);
            partials[k] += weight * others;
        }
    }
}
