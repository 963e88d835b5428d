use super::*;
use crate::limits::line::line;
use crate::problem::period::Resolution;
use crate::{CubicTerms, Problem};
use quietcut_testkit::case;

#[test]
fn the_sum_over_all_harmonics_is_the_change_of_the_limit() {
    for (name, rpm, depth_mm) in [
        ("kuka-kr90-acetal", 900.0, 4.0),
        ("kuka-kr90-acetal", 1045.0, 4.0),
        ("insperger-2dof-ad0.5", 6100.0, 3.0),
        ("insperger-2dof-ad1", 9000.0, 3.0),
    ] {
        let problem = Problem::new(&case(name), CubicTerms::Refuse).unwrap();
        // All poles move by 1e-5 of their size: the receptances are those of a faster and stiffer structure. Central
        // differences leave the third order of this change.
        let scaled = |factor: f64| {
            let mut changed = problem.clone();
            changed.structure.a *= factor;
            changed
        };
        let [slower, faster] = [scaled(1.0 - 1e-5), scaled(1.0 + 1e-5)];
        let limits = |problem: &Problem| line(problem, rpm, depth_mm, 40).unwrap().switches;
        let (before, [low, high]) = (limits(&problem), [limits(&slower), limits(&faster)]);
        assert!(before.len() == low.len() && before.len() == high.len() && !before.is_empty());
        let period = Period::new(&problem, rpm, 2e-3 * depth_mm, Resolution::WORKING);
        for (before, (low, high)) in before.iter().zip(low.iter().zip(&high)) {
            let crossing = Crossing {
                multiplier: before.multiplier(problem.tooth_period_s(rpm)).unwrap(),
                depth_m: 1e-3 * before.depth_mm,
            };
            let mode = PortMode::new(&problem, rpm, &period, crossing).unwrap();
            let change = |s| {
                let [slower, faster] =
                    [&slower, &faster].map(|problem| problem.structure.transfer(s).unwrap());
                (faster - slower) * Complex64::from(0.5)
            };
            let sum_mm: f64 = 1e3 * mode.shifts_m(change).sum::<f64>();
            let exact_mm = 0.5 * (high.depth_mm - low.depth_mm);
            // Tolerance: limits are solved to 1e-9 of their depth; the harmonics beyond the tail.
            let tolerance_mm = 2e-3 * exact_mm.abs() + 4e-9 * before.depth_mm;
            assert!(
                (sum_mm - exact_mm).abs() < tolerance_mm,
                "{name} {rpm} {before:?}: {sum_mm} {exact_mm}"
            );
            assert!(1e3 * mode.largest_shift_m(change).unwrap() >= sum_mm.abs());
        }
    }
}
