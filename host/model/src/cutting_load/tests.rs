use super::*;
use std::path::Path;

fn case(extra: &str, limits: &str) -> Case {
    let text = format!(
        "[tool]\nteeth = 4\nedge_angle_deg = 90.0\ndiameter_mm = 20.0\n{extra}\n[material]\nktc_mpa = 700.0\nkrc_mpa = 210.0\n\
         kac_mpa = 50.0\nkte_n_per_mm = 25.0\nkre_n_per_mm = 40.0\nkae_n_per_mm = 2.0\n\
         [cut]\nstart_deg = 0.0\nexit_deg = 180.0\nfeed_per_tooth_mm = 0.1\n{limits}"
    );
    Case::parse(Path::new("cut.toml"), &text).unwrap()
}

#[test]
fn the_torque_of_a_slot_is_that_of_the_closed_form() {
    let load = CuttingLoad::of_case(&case("", "")).unwrap();
    // A slot: cos 0 − cos π = 2. Per mm of depth N·R/(2π)·(2·K_tc·f + π·K_te), with R in m and forces in N per mm.
    let closed = 4.0 * 0.01 / TAU * (2.0 * 700.0 * 0.1 + std::f64::consts::PI * 25.0);
    let torque = load.torque_nm_per_mm(6000.0).unwrap();
    // Rounding: the rule is exact for a sine over half a revolution to 1e-16.
    assert!((torque / closed - 1.0).abs() < 1e-12, "{torque} {closed}");
    // Without edges a slot removes the volume a·D·f·N per revolution at the energy K_tc per volume: 2πT = K_tc·D·f·N·a.
    let mut without_edges = case("", "");
    if let Some(material) = &mut without_edges.material {
        material.kte_n_per_mm = 0.0;
    }
    let torque = CuttingLoad::of_case(&without_edges)
        .unwrap()
        .torque_nm_per_mm(1.0)
        .unwrap();
    let per_revolution_j = 700.0 * 20.0 * 0.1 * 4.0 * 1e-3;
    assert!((TAU * torque / per_revolution_j - 1.0).abs() < 1e-12, "{torque}");
    // Power is torque times angular speed.
    let power = load.power_w_per_mm(6000.0).unwrap();
    assert!((power / (closed * TAU * 100.0) - 1.0).abs() < 1e-12, "{power}");
}

#[test]
fn the_torque_is_that_of_a_sum_over_small_rotations() {
    // Partial immersion, unequal pitch, an edge angle and a power law: the sum over 20 000 positions of all teeth.
    let mut case = case(
        "pitch_deg = [80.0, 100.0, 80.0, 100.0]",
        "[extension.force-exponent]\nexponent = 0.7\nreference_chip_mm = 0.05\n",
    );
    if let Some(tool) = &mut case.tool {
        tool.edge_angle_deg = 50.0;
    }
    if let Some(cut) = &mut case.cut {
        (cut.start_deg, cut.exit_deg) = (110.0, 170.0);
    }
    const STEPS: usize = 20_000;
    let (sin, mut sum) = (50.0_f64.to_radians().sin(), 0.0);
    // Pitch of each tooth, and with it its feed, by its angle on the tool.
    let teeth = [(0.0, 100.0), (100.0, 80.0), (180.0, 100.0), (280.0, 80.0_f64)];
    for step in 0..STEPS {
        for (angle, pitch) in teeth {
            let phi = (360.0 * step as f64 / STEPS as f64 + angle) % 360.0;
            if (110.0..170.0).contains(&phi) {
                let chip_mm = 0.1 * pitch / 90.0 * phi.to_radians().sin() * sin;
                sum += 700.0 * 0.05 * (chip_mm / 0.05_f64).powf(0.7) + 25.0 / sin;
            }
        }
    }
    let brute = 0.01 * sum / STEPS as f64;
    let torque = CuttingLoad::of_case(&case)
        .unwrap()
        .torque_nm_per_mm(3000.0)
        .unwrap();
    // Ends of the engagement in the sum are right to one of 3 333 steps per tooth.
    assert!((torque / brute - 1.0).abs() < 1e-3, "{torque} {brute}");
}

#[test]
fn the_smaller_of_power_and_torque_limits_the_depth() {
    let case = case(
        "",
        "[limits]\nrpm_min = 500.0\nrpm_max = 12000.0\npower_w = 3000.0\ntorque_nm = 20.0\n",
    );
    let load = CuttingLoad::of_case(&case).unwrap();
    let per_mm = load.torque_nm_per_mm(1.0).unwrap();
    // 3 000 W at 20 N·m: 1 432 rev/min.
    let slow = load.driven_depth(1400.0).unwrap().unwrap();
    assert!(slow.by == LoadLimit::Torque && (slow.depth_mm * per_mm - 20.0).abs() < 1e-9);
    let fast = load.driven_depth(9000.0).unwrap().unwrap();
    let power_w = fast.depth_mm * per_mm * TAU * 150.0;
    assert!(fast.by == LoadLimit::Power && (power_w - 3000.0).abs() < 1e-6);
    assert!(CuttingLoad::of_limited(&case).unwrap().is_some());
    let mut unlimited = case;
    unlimited.limits = None;
    assert!(CuttingLoad::of_limited(&unlimited).unwrap().is_none());
    let load = CuttingLoad::of_case(&unlimited).unwrap();
    assert_eq!(load.driven_depth(1e3).unwrap(), None);
}

#[test]
fn a_tool_without_diameter_is_refused_with_the_key() {
    let mut case = case("", "");
    if let Some(tool) = &mut case.tool {
        tool.diameter_mm = None;
    }
    let error = CuttingLoad::of_case(&case).unwrap_err().to_string();
    assert!(
        error.contains("diameter_mm") && error.contains("cut.toml"),
        "{error}"
    );
}

#[test]
fn limits_of_the_spindle_are_checked() {
    let parse = |keys: &str| {
        let text = format!("[limits]\nrpm_min = 500.0\nrpm_max = 9000.0\n{keys}\n");
        Case::parse(Path::new("cut.toml"), &text)
    };
    let read = parse(
        "ranges_rpm = [[500.0, 1500.0], [2000.0, 9000.0]]\npower_curve_rpm_w = [[0.0, 0.0], [9000.0, 4000.0]]",
    );
    assert_eq!(read.unwrap().limits.unwrap().power_at_w(4500.0), Some(2000.0));
    for (keys, named) in [
        ("ranges_rpm = [[500.0, 1500.0], [1200.0, 9000.0]]", "[1200, 9000]"),
        ("ranges_rpm = [[400.0, 1500.0]]", "within 500 to 9000"),
        ("ranges_rpm = []", "no range"),
        ("torque_nm = 0.0", "limits.torque_nm"),
        (
            "torque_curve_rpm_nm = [[600.0, 40.0], [9000.0, 20.0]]",
            "from 600 to 9000",
        ),
        ("power_curve_rpm_w = [[0.0, 0.0], [0.0, 3.0]]", "point 2"),
        ("power_curve_rpm_w = [[0.0, -1.0], [9000.0, 3.0]]", "point 1"),
        ("power_curve_rpm_w = []", "no point"),
    ] {
        let error = parse(keys).unwrap_err().to_string();
        assert!(error.contains(named) && error.contains("line 4"), "{error}");
    }
}
