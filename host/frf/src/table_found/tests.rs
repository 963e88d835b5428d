//! Tables of FRF as other programs write them.

use quietcut_recording::ColumnMap;

use super::*;

fn import(text: &str, map: &[&str]) -> Result<ImportedTable, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.csv");
    std::fs::write(&path, text).unwrap();
    let import = Import {
        map: map.iter().map(|map| ColumnMap::parse(map).unwrap()).collect(),
        ..Import::default()
    };
    FrfTable::import(&path, &import).map_err(|error| error.to_string())
}

fn value(table: &ImportedTable) -> Complex64 {
    table.table.entries()[0].receptance[0]
}

#[test]
fn parts_units_and_directions_are_understood() {
    let omega = Complex64::new(0.0, TAU * 10.0);
    let h = Complex64::new(3e-6, -4e-6);
    let (mag, phase) = h.to_polar();
    let a = h * omega * omega;
    let v = h * omega;
    for (text, name) in [
        (
            format!(
                "Frequency (Hz),Hxx Real (m/N),Hxx Imag (m/N)\n10,{},{}\n20,1,1\n",
                h.re, h.im
            ),
            "xx",
        ),
        (
            format!(
                "Freq [Hz];Mag Hyy [um/N];Phase Hyy [deg]\n10;{};{}\n20;1;1\n",
                1e6 * mag,
                phase.to_degrees()
            ),
            "yy",
        ),
        (
            format!(
                "frequency,H_xy Re [(m/s^2)/N],H_xy Im [(m/s^2)/N]\n0,1,0\n10,{},{}\n20,1,1\n",
                a.re, a.im
            ),
            "xy",
        ),
        (
            format!(
                "f [Hz]\thzz real [m/s/N]\thzz imag [m/s/N]\n10\t{}\t{}\n20\t1\t1\n",
                v.re, v.im
            ),
            "zz",
        ),
        (
            format!(
                "Frequency (Hz),Hxx Real [1/kg],Hxx Imag [1/kg]\n0,1,0\n10,{},{}\n20,1,1\n",
                a.re, a.im
            ),
            "xx",
        ),
        (
            format!(
                "Frequency (Hz),Hxx (dB re 1 m/N),Hxx Phase (rad)\n10,{},{phase}\n20,1,1\n",
                20.0 * mag.log10()
            ),
            "xx",
        ),
    ] {
        let found = import(&text, &[]).unwrap_or_else(|error| panic!("{text}: {error}"));
        assert_eq!(found.table.entries()[0].name(), name, "{text}");
        // Tolerance: rounding of dB and phase.
        assert!(
            (value(&found) - h).norm() < 1e-12 * h.norm(),
            "{text}: {}",
            value(&found)
        );
        assert!(found.understood.is_some());
    }
}

#[test]
fn tables_without_unit_or_direction_are_refused_with_the_option_that_mends_it() {
    let plain = "Frequency (Hz),Real,Imag\n10,3e-6,-4e-6\n20,1e-6,1e-6\n";
    let said = import(plain, &[]).unwrap_err();
    for words in [
        "directions",
        "unit",
        "--map \"Real=hxx_re:m/N,Imag=hxx_im:m/N\"",
        "a.toml",
        "[channels.\"Real\"]",
    ] {
        assert!(said.contains(words), "{words}: {said}");
    }
    let found = import(plain, &["Real=hyy_re:m/N", "Imag=hyy_im:m/N"]).unwrap();
    assert_eq!(
        (value(&found), found.table.entries()[0].name().as_str()),
        (Complex64::new(3e-6, -4e-6), "yy")
    );
    let several = "Freq;Mag 1;Phase 1;Mag 2;Phase 2\n10;1;-170;2;3\n20;1;5;2;100\n";
    let said = import(several, &[]).unwrap_err();
    assert!(said.contains("Mag 2=hyx_mag:m/N,Phase 2=hyx_phase:deg"), "{said}");
    let said = import("Frequency (Hz),Real\n1,2\n2,3\n", &[]).unwrap_err();
    assert!(said.contains("stands alone"), "{said}");
    let lone = "Freq [Hz];Mag Hyy [um/N];Phase Hyy [deg];Phase Hxx [deg]\n10;1;2;3\n20;1;1;1\n";
    let said = import(lone, &[]).unwrap_err();
    assert!(
        said.contains("Phase Hxx") && said.contains("stands alone"),
        "{said}"
    );
    let said = import(
        "Frequency (Hz),Mag Hxx (m/N),Phase Hxx (deg)\n1,-20,3\n2,-21,3\n",
        &[],
    )
    .unwrap_err();
    assert!(said.contains("0 or more") && said.contains("hxx_db"), "{said}");
}

#[test]
fn the_unit_of_a_phase_is_taken_only_where_values_leave_no_choice() {
    let degrees = phase_unit(&[-170.0, 10.0]).unwrap();
    assert!((degrees * 180.0 - std::f64::consts::PI).abs() < 1e-15);
    assert_eq!(phase_unit(&[-3.1, 0.1]), Some(1.0));
    assert_eq!(phase_unit(&[-0.3, 0.1]), None);
    assert_eq!(phase_unit(&[-7.0, 0.1]), None);
}

#[test]
fn a_stated_frequency_column_keeps_its_unit() {
    let map = ["w=frequency_hz", "2=hxx_re:m/N", "3=hxx_im:m/N"];
    for (unit, factor) in [
        (" [kHz]", 1e3),
        (" [rad/s]", 1.0 / TAU),
        (" [Hz]", 1.0),
        ("", 1.0),
    ] {
        let table = import(&format!("w{unit},a,b\n10,1,2\n20,1,1\n"), &map).unwrap();
        assert_eq!(
            table.table.frequency_hz(),
            [10.0 * factor, 20.0 * factor],
            "{unit}"
        );
    }
    let refused = import("w [mm],a,b\n10,1,2\n20,1,1\n", &map).unwrap_err();
    assert!(refused.contains("frequency_hz in \"mm\""), "{refused}");
}

/// The option that a message names, taken as it stands, gives the right receptance: units that the titles state stay.
#[test]
fn the_option_that_a_message_names_keeps_the_stated_units() {
    let omega = TAU * 10.0;
    let h = Complex64::new(3e-6, -4e-6);
    let (mag, phase) = h.to_polar();
    let a = -h * omega * omega;
    for text in [
        format!(
            "Frequency (Hz),Real (mm/N),Imag (mm/N)\n10,{},{}\n20,1,1\n",
            1e3 * h.re,
            1e3 * h.im
        ),
        format!(
            "Frequency (Hz),Real (µm/kN),Imag (µm/kN)\n10,{},{}\n20,1,1\n",
            1e9 * h.re,
            1e9 * h.im
        ),
        format!(
            "Frequency (Hz),Real (g/N),Imaginary (g/N)\n10,{},{}\n20,1,1\n",
            a.re / 9.806_65,
            a.im / 9.806_65
        ),
        format!(
            "Frequency (kHz),Real ((m/s²)/N),Imag ((m/s²)/N)\n0.01,{},{}\n0.02,1,1\n",
            a.re, a.im
        ),
        format!("Frequency (Hz),Magnitude (m/N),Phase (rad)\n10,{mag},{phase}\n20,1e-6,1\n"),
        format!("Frequency (Hz),Magnitude (m/N),Phase\n10,{mag},{phase}\n20,1e-6,1.1\n30,1e-6,-1.4\n"),
        format!(
            "Frequency (Hz),Magnitude (m/N),Phase (deg)\n10,{mag},{}\n20,1e-6,1\n",
            phase.to_degrees()
        ),
    ] {
        let said = import(&text, &[]).unwrap_err();
        let map = said
            .split("--map \"")
            .nth(1)
            .and_then(|rest| rest.split('"').next());
        let map: Vec<&str> = map.unwrap_or_else(|| panic!("{said}")).split(',').collect();
        let found = import(&text, &map).unwrap_or_else(|error| panic!("{map:?}: {error}"));
        assert!(
            (value(&found) - h).norm() < 1e-9 * h.norm(),
            "{map:?}: {}",
            value(&found)
        );
    }
}
