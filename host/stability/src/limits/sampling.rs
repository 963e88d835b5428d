//! Random machines of a case with uncertain parameters: the independent variables, and stratified draws of them.

use nalgebra::DVector;
use quietcut_numerics::statistics::normal_quantile;
use rand::seq::SliceRandom;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use quietcut_model::case::{Case, Deviation, Parameter};

/// One standard normal variable: parameters that vary together, each by its standard deviation times the variable.
#[derive(Clone, Debug, PartialEq)]
pub struct Variable {
    parts: Vec<Deviation>,
}

impl Variable {
    /// Independent variables of a case.
    ///
    /// Deviations are independent, except for entries (i, j) and (j, i) of a matrix: with equal values and equal
    /// deviations they are one number and vary together. Parameters with a joint covariance follow from further
    /// independent variables, each of which moves one or more of them.
    pub fn of_case(case: &Case) -> Vec<Self> {
        let mut variables: Vec<Self> = Vec::new();
        for &deviation in &case.deviations {
            let mirrored = mirrored(deviation.parameter);
            let twin = variables.iter_mut().find(|variable| {
                variable.parts.iter().any(|part| {
                    Some(part.parameter) == mirrored
                        && part.std == deviation.std
                        && part.parameter.value(case) == deviation.parameter.value(case)
                })
            });
            match twin {
                Some(variable) => variable.parts.push(deviation),
                None => variables.push(Self {
                    parts: vec![deviation],
                }),
            }
        }
        let jointly = case.covariance.iter().flat_map(|known| known.independent_parts());
        variables.extend(jointly.map(Self::together));
        variables
    }

    /// Uncertain variable of parameters that vary together; a parameter with a negative standard deviation falls when
    /// the others rise.
    pub fn together(parts: Vec<Deviation>) -> Self {
        Self { parts }
    }

    /// Parameters that vary together.
    pub fn parts(&self) -> &[Deviation] {
        &self.parts
    }

    /// Shifts the parameters of this variable in a case by a number of standard deviations; false if a value is then
    /// not valid.
    pub fn shift(&self, case: &mut Case, deviations: f64) -> bool {
        self.parts
            .iter()
            .all(|part| part.parameter.shift(case, part.std * deviations))
    }

    /// Shifts the parameters of a case to the machine at the values `machine` of the variables; false if a value is
    /// then not valid.
    ///
    /// A parameter that several variables move is shifted once, by their sum: the bounds of its value hold for the sum
    /// alone.
    pub fn shift_all(variables: &[Self], machine: &DVector<f64>, case: &mut Case) -> bool {
        let mut shifts: Vec<Deviation> = Vec::new();
        for (variable, deviations) in variables.iter().zip(machine.iter()) {
            for part in &variable.parts {
                let by = part.std * deviations;
                match shifts.iter_mut().find(|shift| shift.parameter == part.parameter) {
                    Some(shift) => shift.std += by,
                    None => shifts.push(Deviation { std: by, ..*part }),
                }
            }
        }
        shifts.iter().all(|shift| shift.parameter.shift(case, shift.std))
    }
}

/// The mirrored entry (j, i) of a structural matrix for its entry (i, j); `None` for diagonal entries and other
/// parameters.
fn mirrored(parameter: Parameter) -> Option<Parameter> {
    match parameter {
        Parameter::Mass(i, j) if i != j => Some(Parameter::Mass(j, i)),
        Parameter::Damping(i, j) if i != j => Some(Parameter::Damping(j, i)),
        Parameter::Stiffness(i, j) if i != j => Some(Parameter::Stiffness(j, i)),
        Parameter::CubicDamping(i, j) if i != j => Some(Parameter::CubicDamping(j, i)),
        Parameter::CubicStiffness(i, j) if i != j => Some(Parameter::CubicStiffness(j, i)),
        _ => None,
    }
}

/// Orthonormal basis of the uncertain variables whose first vectors span given leading directions.
#[derive(Clone, Debug)]
pub struct Basis {
    vectors: Vec<DVector<f64>>,
}

impl Basis {
    /// Orthonormal basis that starts with the directions of the vectors `leading`, the most important first. Vectors
    /// that vanish, or depend on earlier ones to a thousandth of their length, are skipped; unit vectors complete the
    /// basis.
    pub fn new(size: usize, leading: &[DVector<f64>]) -> Self {
        let unit = |index: usize| DVector::from_fn(size, |i, _| if i == index { 1.0 } else { 0.0 });
        let mut vectors: Vec<DVector<f64>> = Vec::with_capacity(size);
        for candidate in leading.iter().cloned().chain((0..size).map(unit)) {
            let length = candidate.norm();
            let mut rest = candidate;
            // Two passes of orthogonalization leave only rounding along the earlier basis vectors.
            for _ in 0..2 {
                for vector in &vectors {
                    let along = vector.dot(&rest);
                    rest.axpy(-along, vector, 1.0);
                }
            }
            let left = rest.norm();
            // While basis vectors are missing, some unit vector keeps at least 1/√size of its length after
            // orthogonalization, far above the threshold of 1e-3.
            if vectors.len() < size && left > 1e-3 * length && left.is_finite() && left > 0.0 {
                vectors.push(rest / left);
            }
        }
        Self { vectors }
    }

    /// Values of the uncertain variables at the point with the given coordinates in this basis.
    fn point(&self, coordinates: &[f64]) -> DVector<f64> {
        let size = self.vectors.first().map_or(0, |vector| vector.len());
        let mut point = DVector::zeros(size);
        for (vector, coordinate) in self.vectors.iter().zip(coordinates) {
            point.axpy(*coordinate, vector, 1.0);
        }
        point
    }

    /// Draws `count` points (a power of 2) of the standard normal distribution: stratified in `count` slices of equal
    /// probability along the first basis vector, a Hammersley set along the first two, Latin hypercube along the
    /// others, with random shifts along all but the first.
    ///
    /// Along the first vector the points of 2, 4, 8 … batches (numbered from 0) interleave.
    pub fn points(&self, count: u32, seed: u64, stream: u64, batch: u32) -> Vec<DVector<f64>> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(stream);
        let size = self.vectors.len();
        let n = f64::from(count);
        // Position of this batch in the slices along the first basis vector: the radical inverse 0, 1/2, 1/4, 3/4 … of
        // its number. With 1/8 added, the points of four batches lie at the middles of the quarters of each slice.
        let first = f64::from(batch.reverse_bits()) / 2.0_f64.powi(32) + 0.125;
        let second: f64 = rng.random();
        let mut latin: Vec<Vec<f64>> = Vec::with_capacity(size.saturating_sub(2));
        for _ in 2..size {
            let mut slices: Vec<f64> = (0..count).map(f64::from).collect();
            slices.shuffle(&mut rng);
            let shifted = slices.into_iter().map(|slice| (slice + rng.random::<f64>()) / n);
            latin.push(shifted.collect());
        }
        let bits = count.trailing_zeros();
        (0..count)
            .map(|i| {
                let reversed = f64::from(i.reverse_bits() >> (32 - bits.max(1)));
                let hammersley = [
                    ((f64::from(i) + first) / n).fract(),
                    ((reversed + 0.5) / n + second).fract(),
                ];
                let others = latin.iter().map(|slices| slices[i as usize]);
                let shares = hammersley.into_iter().chain(others);
                let coordinates: Vec<f64> = shares.take(size).map(normal_quantile).collect();
                self.point(&coordinates)
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use quietcut_numerics::statistics::normal_probability;

    use super::*;

    #[test]
    fn quantiles_are_those_of_the_tables() {
        // Reference values: Abramowitz & Stegun, table 26.5.
        for (share, x) in [
            (0.05, -1.644_853_626_951_473),
            (0.5, 0.0),
            (0.95, 1.644_853_626_951_473),
            (0.975, 1.959_963_984_540_054),
            (1e-6, -4.753_424_308_822_899),
            (0.3, -0.524_400_512_708_041),
        ] {
            assert!(
                (normal_quantile(share) - x).abs() < 1e-11,
                "{share} {}",
                normal_quantile(share)
            );
        }
    }

    #[test]
    fn points_fill_the_distribution_evenly_along_every_vector() {
        let leading = [
            DVector::from_vec(vec![3.0, 4.0, 0.0, 0.0]),
            DVector::from_vec(vec![0.0, 0.0, 0.0, 0.0]),
        ];
        let basis = Basis::new(4, &leading);
        assert_eq!(basis.vectors.len(), 4);
        let points = basis.points(64, 1, 2, 0);
        for vector in &basis.vectors {
            let mut slices: Vec<usize> = points
                .iter()
                .map(|point| (normal_probability(vector.dot(point)) * 64.0) as usize)
                .collect();
            slices.sort_unstable();
            // The shift of the second vector wraps around: each slice contains one point, or its neighbour contains
            // two.
            for (expected, slice) in slices.iter().enumerate() {
                assert!(slice.abs_diff(expected) <= 1, "{slices:?}");
            }
        }
        assert_eq!(points, basis.points(64, 1, 2, 0));
        assert_ne!(points, basis.points(64, 1, 3, 0));
    }

    #[test]
    fn symmetric_entries_of_a_matrix_vary_together() {
        let text = r#"
[structure]
kind = "matrices"
directions = ["x", "y"]
mass = [[1.0, 0.1], [0.1, 1.0]]
mass_std = [[0.0, 0.01], [0.01, 0.0]]
damping = [[1.0, 0.2], [0.1, 1.0]]
damping_std = [[0.0, 0.01], [0.01, 0.0]]
stiffness = [[1.0, 0.0], [0.0, 1.0]]
"#;
        let case = Case::parse(std::path::Path::new("a.toml"), text).unwrap();
        let sizes: Vec<usize> = Variable::of_case(&case).iter().map(|v| v.parts.len()).collect();
        assert_eq!(sizes, [2, 1, 1]);
    }
}
