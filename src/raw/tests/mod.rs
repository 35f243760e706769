mod builder;
mod dng;
mod ljpeg;
mod mutations;
mod nef;
mod pictures;
mod reading;
