//! Every effect in a case: text → case → effect → text → case.

use std::path::Path;

use proptest::prelude::*;

use super::*;
use crate::case::Case;

fn case(text: &str) -> Case {
    Case::parse(Path::new("machine.toml"), text).unwrap_or_else(|error| panic!("{error}"))
}

fn table(spec: &EffectSpec) -> toml::Table {
    spec.example.parse().unwrap()
}

fn text(name: &str, table: &toml::Table) -> String {
    let tables = toml::Table::from_iter([(name.to_owned(), table.clone().into())]);
    toml::to_string(&toml::Table::from_iter([("extension".to_owned(), tables.into())])).unwrap()
}

fn described(case: &Case) -> String {
    format!("{:?}", Effects::of_case(case).unwrap())
}

/// Effect of a table `[extension.NAME]` after it is written to text and parsed.
fn comes_back(spec: &EffectSpec, table: &toml::Table) {
    let once = case(&text(spec.name, table));
    assert_eq!(once.effects().map(|spec| spec.id).collect::<Vec<_>>(), [spec.id]);
    let again = case(&text(spec.name, &once.extensions[spec.name]));
    assert_eq!(again.extensions, once.extensions);
    assert_eq!(described(&again), described(&once));
    assert!(
        Effects::of_case(&once)
            .unwrap()
            .0
            .iter()
            .all(|effect| effect.id() == spec.id)
    );
}

#[test]
fn every_example_comes_back() {
    for spec in ALL {
        comes_back(spec, &table(spec));
    }
}

/// Value at the fraction `share` of the interval of a parameter; infinite bounds are replaced by ±1000.
fn within(prior: Prior, share: f64) -> f64 {
    let (low, high) = (prior.low.max(-1e3), prior.high.min(1e3));
    low + (high - low) * (0.001 + 0.998 * share)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn every_value_within_its_bounds_comes_back(shares in prop::collection::vec(0.0..1.0_f64, 8)) {
        for spec in ALL {
            let mut table = table(spec);
            for (parameter, share) in spec.parameters.iter().zip(&shares) {
                if let Some(value) = table.get_mut(parameter.key)
                    && parameter.kind == ValueKind::Number
                {
                    *value = within(parameter.prior, *share).into();
                }
            }
            comes_back(spec, &table);
        }
    }

    #[test]
    fn every_value_beyond_its_bounds_is_refused(beyond in 1e-3..1e3_f64) {
        for spec in ALL {
            for parameter in spec.parameters.iter().filter(|own| table(spec).contains_key(own.key)) {
                for wrong in [parameter.prior.low - beyond, parameter.prior.high + beyond, f64::NAN] {
                    let mut table = table(spec);
                    table.insert(parameter.key.into(), wrong.into());
                    let text = text(spec.name, &table);
                    prop_assert!(Case::parse(Path::new("machine.toml"), &text).is_err(), "{text}");
                }
            }
        }
    }
}
