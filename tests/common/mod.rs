//! What several tests share: arms and measurements that the model itself makes.

#![allow(dead_code, reason = "each test takes what it needs")]

pub mod arms;
pub mod bounded;
pub mod effects;
pub mod made;
pub mod schema;
