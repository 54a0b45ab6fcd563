#!/usr/bin/env bash
# Runs LAMMPS on the boxes of ammonia of `benches/rivals`, on one core: its time a step beside that of fields, and the
# difference between the initial forces of both. Needs `lmp` (Debian: lammps); LMP names another executable.
#
#     benches/lammps.sh [STEPS]
set -euo pipefail
cd "$(dirname "$0")/.."

steps=${1:-200}
lmp=${LMP:-lmp}
command -v "$lmp" > /dev/null || { echo "LAMMPS is not here: no $lmp" >&2; exit 3; }
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
export OMP_NUM_THREADS=1

# The times of fields, and the same states in files.
cargo bench --quiet --bench rivals -- "--states=$folder" molecules > "$folder/fields.txt"

# The same physics: rigid molecules, both laws with the force shifted to reach zero at the cutoff.
cat > "$folder/in.ammonia" << 'IN'
units metal
atom_style full
boundary s s s
read_data ${data}
pair_style hybrid/overlay lj/smooth/linear 10.0 coul/dsf 0.0 10.0
pair_coeff * * coul/dsf
pair_coeff 1 1 lj/smooth/linear ${epsilon} 3.42
neighbor 2.0 bin
neigh_modify delay 0 every 1 check yes exclude molecule/intra all
timestep 0.001
fix rigid all rigid/nve/small molecule
thermo 1000000
dump forces all custom 1000000 ${data}.lammps id mol fx fy fz
dump_modify forces sort id format float %.12g
run 0
undump forces
run ${steps}
IN

echo "| scene | LAMMPS, µs a step | fields, kick-drift-kick, whole step | ratio | forces apart, r.m.s. |"
echo "|---|---|---|---|---|"
for data in "$folder"/*.data; do
    name=$(basename "$data" .data)
    # The median of three runs; epsilon is 71.128 amu Å²/ps² in eV.
    theirs=$(for _ in 1 2 3; do
        "$lmp" -in "$folder/in.ammonia" -var data "$data" -var steps "$steps" \
            -var epsilon 0.00737189772 -log "$folder/log" -screen none
        awk '/^Loop time/ { micros = 1e6 * $4 / $9 } END { print micros }' "$folder/log"
    done | sort -g | sed -n 2p)
    ours=$(awk -v name="$name" '
        /molecules$/ { here = $0; gsub(/ /, "_", here) }
        /field, kick-drift-kick/ && here == name && /a step/ {
            sub(/.*kick-drift-kick */, ""); print $1; exit
        }' "$folder/fields.txt")
    # eV/Å in amu Å/ps².
    apart=$(awk -v unit=9648.53321233 '
        FNR == NR { x[FNR] = $1; y[FNR] = $2; z[FNR] = $3; next }
        /^ITEM: ATOMS/ { atoms = 1; next }
        atoms { fx[$2] += $3; fy[$2] += $4; fz[$2] += $5 }
        END {
            for (m in x) {
                off += (fx[m] * unit - x[m]) ^ 2 + (fy[m] * unit - y[m]) ^ 2 + (fz[m] * unit - z[m]) ^ 2
                all += x[m] ^ 2 + y[m] ^ 2 + z[m] ^ 2
            }
            # In the gas no molecules are in reach of each other at the start.
            if (all > 0) { printf "%.1e", sqrt(off / all) } else { printf "none" }
        }' "${data%.data}.forces" "$data.lammps")
    ratio=$(awk -v ours="$ours" -v theirs="$theirs" 'BEGIN { printf "%.2f", ours / theirs }')
    printf '| %s | %.0f | %.0f | %s | %s |\n' "${name//_/ }" "$theirs" "$ours" "$ratio" "$apart"
done
