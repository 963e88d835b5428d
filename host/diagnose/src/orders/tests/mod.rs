//! Tests of the orders on signals whose equations stand here: nothing of the generator uses the room.

mod aliasing;
mod asynchronous;
mod cost;
mod coverage;
mod generator;
mod speed;
mod spindle;
