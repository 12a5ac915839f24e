//! Describes and packs the FMU.
fn main() -> std::process::ExitCode {
    fmu_export::run::<models::boom::Boom>()
}
