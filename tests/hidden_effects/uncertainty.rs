//! What tests of a machine leave uncertain of it: the baseline is drawn from this uncertainty, and the case states it.

use std::fmt::Write as _;

use nalgebra::{DMatrix, DVector};

use super::job::Job;
use super::machine::Machine;

/// Relative standard deviations of the natural frequency, damping ratio and modal mass that a tap test finds.
const MODE: [f64; 3] = [0.002, 0.04, 0.015];
/// Standard deviation of a coupling between directions, as a share of the root of the product of the diagonal entries.
const COUPLING: f64 = 0.003;
/// Relative standard deviations of cutting and edge coefficients from cutting tests, and of a measured runout.
const CUTTING: f64 = 0.03;
const EDGE: f64 = 0.05;
const RUNOUT: f64 = 0.3;

/// Number of independent uncertain values of a machine and its job.
pub(crate) fn count(machine: &Machine) -> usize {
    of_structure(machine) + 3 + 3 + 1
}

fn of_structure(machine: &Machine) -> usize {
    let n = machine.mass.nrows();
    3 * n + 3 * n * (n - 1) / 2
}

/// The machine and job that differ from the given ones by `z` standard deviations.
pub(crate) fn moved(machine: &Machine, job: &Job, z: &[f64]) -> (Machine, Job) {
    let (mut machine, mut job) = (moved_machine(machine, z), job.clone());
    let first = of_structure(&machine);
    for index in 0..3 {
        job.cutting_mpa[index] *= 1.0 + CUTTING * z[first + index];
        job.edge_n_per_mm[index] *= 1.0 + EDGE * z[first + 3 + index];
    }
    job.runout[0] *= 1.0 + RUNOUT * z[first + 6];
    let slowest = |i: usize| (machine.stiffness[(i, i)] / machine.mass[(i, i)]).sqrt();
    let all: Vec<f64> = (0..machine.mass.nrows()).map(slowest).collect();
    machine.omega = [
        all.iter().fold(f64::INFINITY, |a, b| a.min(*b)),
        all.iter().fold(0.0, |a, b| b.max(a)),
    ];
    (machine, job)
}

fn moved_machine(machine: &Machine, z: &[f64]) -> Machine {
    let mut moved = machine.clone();
    let n = machine.mass.nrows();
    for i in 0..n {
        let [frequency, ratio, mass] = [0, 1, 2].map(|part| MODE[part] * z[3 * i + part]);
        moved.mass[(i, i)] *= 1.0 + mass;
        moved.damping[(i, i)] *= 1.0 + mass + ratio + frequency;
        moved.stiffness[(i, i)] *= 1.0 + mass + 2.0 * frequency;
    }
    let mut place = 3 * n;
    for (own, matrix) in [
        (&machine.mass, &mut moved.mass),
        (&machine.damping, &mut moved.damping),
        (&machine.stiffness, &mut moved.stiffness),
    ] {
        for i in 0..n {
            for j in 0..i {
                let change = COUPLING * z[place] * (own[(i, i)] * own[(j, j)]).sqrt();
                matrix[(i, j)] += change;
                matrix[(j, i)] += change;
                place += 1;
            }
        }
    }
    moved
}

/// The section `[uncertainty]` of a case about the structure of `machine`.
pub(crate) fn section(machine: &Machine) -> String {
    let n = machine.mass.nrows();
    let entries = |machine: &Machine| -> Vec<f64> {
        [&machine.mass, &machine.damping, &machine.stiffness]
            .iter()
            .flat_map(|matrix| (0..n).flat_map(move |i| (0..n).map(move |j| matrix[(i, j)])))
            .collect()
    };
    let base = DVector::from_vec(entries(machine));
    let columns: Vec<DVector<f64>> = (0..of_structure(machine))
        .map(|index| {
            let mut z = vec![0.0; of_structure(machine)];
            z[index] = 1.0;
            DVector::from_vec(entries(&moved_machine(machine, &z))) - &base
        })
        .collect();
    let factor = DMatrix::from_columns(&columns);
    let covariance = &factor * factor.transpose();
    let names: Vec<String> = ["mass", "damping", "stiffness"]
        .iter()
        .flat_map(|matrix| {
            (1..=n).flat_map(move |i| (1..=n).map(move |j| format!("\"structure.{matrix}.{i}.{j}\"")))
        })
        .collect();
    let rows: Vec<String> = covariance
        .row_iter()
        .map(|row| {
            let values: Vec<String> = row.iter().map(|value| format!("{value:e}")).collect();
            format!("[{}]", values.join(", "))
        })
        .collect();
    format!(
        "[uncertainty]\nparameters = [{}]\ncovariance = [\n{}\n]\n",
        names.join(", "),
        rows.join(",\n")
    )
}

/// Keys of standard deviations of tool and material, for the sections of these names.
pub(crate) fn keys_of_material(job: &Job) -> String {
    let mut text = String::new();
    for (axis, name) in ["t", "r", "a"].iter().enumerate() {
        let known = [
            ("c_mpa", job.cutting_mpa[axis], CUTTING),
            ("e_n_per_mm", job.edge_n_per_mm[axis], EDGE),
        ];
        for (key, value, share) in known {
            if value != 0.0 {
                writeln!(text, "k{name}{key}_std = {:e}", share * value.abs()).unwrap();
            }
        }
    }
    text
}

/// Keys of the runout for the section of the tool.
pub(crate) fn keys_of_runout(job: &Job) -> String {
    let [offset_um, angle_deg] = job.runout;
    format!(
        "runout_um = {offset_um:e}\nrunout_um_std = {:e}\nrunout_angle_deg = {angle_deg:e}\n",
        RUNOUT * offset_um
    )
}
