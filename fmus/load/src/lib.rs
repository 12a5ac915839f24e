//! Force as a law of time as an FMU. The model: `models::parts::load`.
fmu_export::export!(models::parts::Load);
