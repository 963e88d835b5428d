//! Effects by name, and describing functions against a numerical Fourier sum.

use super::*;

#[test]
fn a_value_and_its_keys_are_one_effect() {
    let effects = Effects::parse(["runout=20", "axial-depth-modulation=1", "runout.angle_deg=-30"]).unwrap();
    let names: Vec<&str> = effects.0.iter().map(|effect| effect.name()).collect();
    assert_eq!(names, ["runout", "axial-depth-modulation"]);
}

#[test]
fn a_switch_is_a_word_or_a_number() {
    let of = |text| format!("{:?}", Effects::parse([text]).unwrap());
    assert_eq!(of("axial-depth-modulation=true"), of("axial-depth-modulation=1"));
    assert_eq!(of("axial-depth-modulation=false"), of("axial-depth-modulation=0"));
    assert_ne!(
        of("axial-depth-modulation=true"),
        of("axial-depth-modulation=false")
    );
}

#[test]
fn a_list_of_directions_is_an_effect_along_each() {
    let of = |text: &str| Effects::of_extension("cubic-stiffness", &text.parse().unwrap());
    let both = of("direction = [\"x\", \"y\"]\nk3_n_per_m3 = [1.0, 2]\n").unwrap();
    let apart = ["x", "y"]
        .into_iter()
        .zip([1.0, 2.0])
        .map(|(direction, k3)| format!("direction = \"{direction}\"\nk3_n_per_m3 = {k3}\n"))
        .map(|text| format!("{:?}", of(&text).unwrap().0[0]));
    let both: Vec<String> = both.0.iter().map(|effect| format!("{effect:?}")).collect();
    assert_eq!(both, apart.collect::<Vec<_>>());
    let alike = Effects::parse(["cubic-stiffness=3", "cubic-stiffness.direction=x,z"]).unwrap();
    assert_eq!(alike.0.len(), 2);
    for wrong in [
        "direction = [\"x\", \"y\"]\nk3_n_per_m3 = [1.0]\n",
        "direction = [\"x\", \"x\"]\nk3_n_per_m3 = 1.0\n",
        "direction = []\nk3_n_per_m3 = 1.0\n",
        "direction = \"x\"\nk3_n_per_m3 = [1.0, 2.0]\n",
        "direction = [\"x\", \"w\"]\nk3_n_per_m3 = 1.0\n",
    ] {
        assert!(matches!(of(wrong), Err(EffectError::Value { .. })), "{wrong}");
    }
}

#[test]
fn a_backlash_before_friction_has_no_unused_value() {
    let of = |more: &[&'static str]| {
        let series = [
            "coulomb-friction=3",
            "backlash=0.05",
            "backlash.before=coulomb-friction",
        ];
        Effects::parse(series.into_iter().chain(more.iter().copied()))
    };
    let alone = of(&["coulomb-friction.direction=y"]).unwrap();
    assert_eq!(alone.0.len(), 1);
    // The direction may stand at either or both.
    for more in [
        &["backlash.direction=y"][..],
        &["backlash.direction=y", "coulomb-friction.direction=y"],
    ] {
        assert_eq!(
            format!("{:?}", of(more).unwrap()),
            format!("{alone:?}"),
            "{more:?}"
        );
    }
    let refused = |more: &[&'static str]| of(more).unwrap_err();
    assert!(matches!(refused(&["backlash.foo=1"]), EffectError::Key { .. }));
    for (more, place) in [
        (
            &["backlash.direction=x", "coulomb-friction.direction=y"][..],
            ("backlash", "direction"),
        ),
        (&["coulomb-friction.play_mm=0.1"], ("coulomb-friction", "play_mm")),
        (
            &["coulomb-friction.contact_mm=0.1"],
            ("coulomb-friction", "contact_mm"),
        ),
    ] {
        assert_eq!(refused(more).location(), Some(place));
    }
}

#[test]
fn lists_of_directions_and_of_channels_together_are_refused() {
    let error = Effects::parse([
        "cross-axis=0.1",
        "cross-axis.direction=x,y",
        "cross-axis.channel=ax,ay",
    ]);
    let message = error.unwrap_err().to_string();
    assert!(
        message.contains("one name beside a list of directions"),
        "{message}"
    );
}

#[test]
fn each_fault_of_an_effect_has_its_own_error() {
    let error = |text| Effects::parse([text]).unwrap_err();
    assert!(matches!(error("runout"), EffectError::Form(_)));
    assert!(matches!(error("runout=lots"), EffectError::Value { .. }));
    assert!(matches!(error("runout=inf"), EffectError::Value { .. }));
    assert!(matches!(
        error("axial-depth-modulation=2"),
        EffectError::Value { .. }
    ));
    assert!(matches!(error("runout.angle_deg=2"), EffectError::Missing { .. }));
    assert!(matches!(
        Effects::parse(["runout=1", "runout.teeth=2"]).unwrap_err(),
        EffectError::Key { .. }
    ));
    // The VALUE of wear is a change over the recording, whose length must be known.
    assert!(matches!(error("wear=0.1"), EffectError::NoDuration { .. }));
    assert!(Effects::parse_over(["wear=0.1"], Some(4.0)).is_ok());
    assert!(matches!(error("weather=1"), EffectError::Unknown(_)));
    assert!(error("weather=1").to_string().contains("runout, process-damping"));
}

#[test]
fn the_list_is_whole_and_each_specification_names_its_own_entry() {
    for (place, id) in EffectName::ALL.into_iter().enumerate() {
        let spec = id.spec();
        assert_eq!(spec.id, id, "{}", spec.name);
        assert_eq!(ALL[place].name, spec.name);
        assert_eq!(spec.name.parse(), Ok(id));
        assert!(
            spec.main().is_some() && !spec.candidates.is_empty(),
            "{}",
            spec.name
        );
        // If an effect shares a term with another, so does the other with it.
        for other in spec.shares_term_with {
            assert!(other.spec().shares_term_with.contains(&id), "{}", spec.name);
        }
    }
}

#[test]
fn a_static_stiffness_that_is_not_known_has_its_reason() {
    use crate::structure::Form;

    let error = |change: fn(&mut crate::structure::Matrices)| {
        let mut structure = crate::case::tests::case("kuka-kr90-y17-low").structure.unwrap();
        let Form::Matrices(matrices) = &mut structure.form else {
            panic!("a structure of matrices");
        };
        change(matrices);
        let effects = Effects::parse(["backlash=0.1"]).unwrap();
        effects.0[0].restoring_forces(&structure).unwrap_err().to_string()
    };
    assert!(error(|matrices| matrices.stiffness.fill(0.0)).contains("it is free to move as a rigid body"));
    assert!(error(|matrices| matrices.mass.fill(-1.0)).contains("the mass matrix is indefinite"));
}

/// Compares each describing function with the Fourier sum of the restoring force over one period of x = X·sin ωt.
#[test]
fn closed_forms_of_describing_functions_are_the_sums() {
    use crate::path::{SampledMotion, restoring_along};
    use std::f64::consts::TAU;

    let structure = crate::case::tests::case("kuka-kr90-y17-low").structure.unwrap();
    let (amplitude, omega, count, periods) = (2e-5, 110.0, 20_000, 12);
    let angle = |sample: usize| TAU * (sample as f64 + 0.5) / f64::from(count);
    let signal = |of: fn(f64) -> f64, size: f64| -> Vec<f64> {
        (0..periods * count as usize)
            .map(|n| size * of(angle(n)))
            .collect()
    };
    let motion = SampledMotion {
        step_s: TAU / omega / f64::from(count),
        x: [Vec::new(), signal(f64::sin, amplitude), Vec::new()],
        v: [Vec::new(), signal(f64::cos, amplitude * omega), Vec::new()],
        ..SampledMotion::default()
    };
    let mut tried = 0;
    for texts in [
        &["cubic-stiffness=-5e12"][..],
        &["quadratic-stiffness=3e9"],
        &["cubic-damping=2.5e6"],
        &[
            "softening-hardening=-5e12",
            "softening-hardening.k5_n_per_m5=4e21",
        ],
        &["quintic-stiffness=4e21"],
        &["quadratic-damping=2e4"],
        &["coulomb-friction=3"],
        &["backlash=0.02", "backlash.stiffness_fraction=0.4"],
        &["hysteresis=2e5", "hysteresis.yield_m=1e-5"],
    ] {
        let effects = Effects::parse(texts.iter().copied()).unwrap();
        for restoring_force in effects
            .0
            .iter()
            .flat_map(|effect| effect.restoring_forces(&structure).unwrap())
        {
            let closed = restoring_force.describing_function(amplitude, omega).unwrap();
            let force = &restoring_along(&*restoring_force, &motion)[1];
            let last = (periods - 1) * count as usize..periods * count as usize;
            let part = |of: fn(f64) -> f64| {
                let sum: f64 = last.clone().map(|n| force[n] * of(angle(n))).sum();
                2.0 * sum / (f64::from(count) * amplitude)
            };
            let summed = num_complex::Complex64::new(part(f64::sin), part(f64::cos));
            let size = closed.norm().max(1.0);
            assert!(
                (summed - closed).norm() < 2e-3 * size,
                "{texts:?}: {summed} {closed}"
            );
            tried += 1;
        }
    }
    // Every describing function of the list is compared.
    let all = ALL.iter().filter(|spec| spec.describing_function.is_some());
    assert_eq!(tried, all.count());
}
