//! Describes and packs the FMU.
fn main() -> std::process::ExitCode {
    fmu_export::run::<models::effi::Plant>()
}
