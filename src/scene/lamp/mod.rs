//! Lamps and skies as they were measured: IES profiles, and latitude-longitude pictures.

pub(in crate::scene) mod environment;
pub(in crate::scene) mod ies;
pub(in crate::scene) mod profile;
