//! Effects by name, and each term against the closed form of its motion.

use super::*;

#[test]
fn a_value_and_its_keys_are_one_effect() {
    let effects = Effects::parse(["runout=20", "axial-depth-modulation=1", "runout.angle_deg=-30"]).unwrap();
    let names: Vec<&str> = effects.0.iter().map(|effect| effect.name()).collect();
    assert_eq!(names, ["runout", "axial-depth-modulation"]);
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
fn what_cannot_be_is_told_apart() {
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
    // A change over the record needs its length.
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
        // A term is shared both ways.
        for other in spec.shares_term_with {
            assert!(other.spec().shares_term_with.contains(&id), "{}", spec.name);
        }
    }
}
