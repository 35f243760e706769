mod builder;
mod dng;
mod mutations;
mod nef;
mod pictures;
mod reading;
