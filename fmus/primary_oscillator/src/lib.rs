//! Chain of one or two driven masses as an FMU. The model: `models::absorber::primary_oscillator`.
fmu_export::export!(models::absorber::PrimaryOscillator);
