//! Tests of the head of a text table.

use super::*;

fn found(text: &str) -> Head {
    head(text.as_bytes()).unwrap()
}

fn titles(head: &Head) -> Vec<String> {
    let columns = head.columns.iter().flatten();
    columns
        .map(|column| match &column.unit {
            FoundUnit::Text(unit) => format!("{} [{unit}]", column.name),
            _ => column.name.clone(),
        })
        .collect()
}

#[test]
fn heads_are_found_behind_prose_units_and_comments() {
    for (text, expected, lines) in [
        ("Time (s),Force (N)\n0,1\n1,2\n", vec!["Time [s]", "Force [N]"], 1),
        (
            "Time,Force,Accel X\n(s),(N),(m/s^2)\n0,1,2\n1,2,3\n",
            vec!["Time [s]", "Force [N]", "Accel X [m/s^2]"],
            2,
        ),
        (
            "Messung vom 3.4.2024\nBearbeiter;Huber\n\nZeit [s];Kraft [N]\n0,0;1,5\n0,1;2,5\n",
            vec!["Zeit [s]", "Kraft [N]"],
            4,
        ),
        ("# t fx ax\n0 1 2\n1 2 3\n", vec!["t", "fx", "ax"], 1),
        ("% made\nt\tfx\n0\t1\n1\t2\n", vec!["t", "fx"], 2),
        ("Time (s) Force (N)\n0 1\n1 2\n", vec!["Time [s]", "Force [N]"], 1),
        ("0 1\n1 2\n", vec![], 0),
        ("t,fx\n0,1\n", vec!["t", "fx"], 1),
    ] {
        let head = found(text);
        assert_eq!(
            (titles(&head), head.lines),
            (expected.iter().map(ToString::to_string).collect(), lines),
            "{text}"
        );
    }
    let german = found("Zeit [s];Kraft [N]\n0,0;1,5\n0,1;2,5\n");
    assert_eq!(
        german.dialect,
        Dialect {
            separator: Separator::Semicolon,
            decimal_comma: true
        }
    );
    let latin = head(b"Zeit [s];a [m/s\xb2]\n0;1\n1;2\n").unwrap();
    assert_eq!(titles(&latin), ["Zeit [s]", "a [m/s²]"]);
    assert_eq!(latin.offset, 18);
}

#[test]
fn text_among_the_first_numbers_is_no_name() {
    let (line, what) = head(b"t,fx\n0,abc\n1,2\n2,3\n").unwrap_err();
    assert!(line == 2 && what.contains("abc"), "{what}");
}

#[test]
fn decimal_commas_between_commas_are_named() {
    for text in [
        "t [s],fx [N],ax [g]\n0,-0,5,1\n0,1,1,5,2,5\n0,2,2,5,3,5\n",
        "t [s],fx [N],ax [g]\n0,0,0,5,1,5\n0,1,1,5,2,5\n0,2,2,5,3,5\n",
    ] {
        let (line, what) = head(text.as_bytes()).unwrap_err();
        for word in ["decimal mark", "semicolons", "3 columns"] {
            assert!(line == 2 && what.contains(word), "{text}: {line}, {what}");
        }
    }
    // Trailing commas are no decimal commas.
    assert!(head(b"t,fx\n0,1,\n1,2,\n").is_ok());
}
