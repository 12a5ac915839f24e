//! Rayleigh-van-der-Pol vibration absorber as an FMU. The model: `models::absorber::rvdp_absorber`.
fmu_export::export!(models::absorber::RvdpAbsorber);
