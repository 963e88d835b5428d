//! Prints the table of all effects, as it stands in `host/CASE.md`.

fn main() {
    print!("{}", quietcut_model::effects::table::markdown());
}
