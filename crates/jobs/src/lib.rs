//! Independent pieces of work, on this computer or by Slurm.
