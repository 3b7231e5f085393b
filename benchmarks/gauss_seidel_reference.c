/* Plain C Gauss-Seidel over edge and volume constraints: what `benchmarks/projections.py` compares Supple's kernels with.
 *
 * The straightforward program: constraints in the mesh's order, positions as (n, 3), no coloring, one thread. Compiled with
 * gcc -O3 -march=native -ffast-math.
 */
#include <math.h>

void project_edges(double *restrict x, const double *restrict w, const int *restrict ends, const double *restrict rest, long n)
{
    for (long c = 0; c < n; c++) {
        const int i = ends[2 * c], j = ends[2 * c + 1];
        double *xi = x + 3 * i, *xj = x + 3 * j;
        const double dx = xi[0] - xj[0], dy = xi[1] - xj[1], dz = xi[2] - xj[2];
        const double length = sqrt(dx * dx + dy * dy + dz * dz);
        const double dlam = -(length - rest[c]) / ((w[i] + w[j]) * length);
        const double a = dlam * w[i], b = dlam * w[j];
        xi[0] += a * dx; xi[1] += a * dy; xi[2] += a * dz;
        xj[0] -= b * dx; xj[1] -= b * dy; xj[2] -= b * dz;
    }
}

/* `rest` holds determinants, six times the rest volumes. */
void project_volumes(double *restrict x, const double *restrict w, const int *restrict tets, const double *restrict rest, long n)
{
    for (long c = 0; c < n; c++) {
        const int a = tets[4 * c], b = tets[4 * c + 1], d = tets[4 * c + 2], e = tets[4 * c + 3];
        double *xa = x + 3 * a, *xb = x + 3 * b, *xd = x + 3 * d, *xe = x + 3 * e;
        const double ux = xb[0] - xa[0], uy = xb[1] - xa[1], uz = xb[2] - xa[2];
        const double vx = xd[0] - xa[0], vy = xd[1] - xa[1], vz = xd[2] - xa[2];
        const double qx = xe[0] - xa[0], qy = xe[1] - xa[1], qz = xe[2] - xa[2];
        const double gbx = vy * qz - vz * qy, gby = vz * qx - vx * qz, gbz = vx * qy - vy * qx;
        const double gdx = qy * uz - qz * uy, gdy = qz * ux - qx * uz, gdz = qx * uy - qy * ux;
        const double gex = uy * vz - uz * vy, gey = uz * vx - ux * vz, gez = ux * vy - uy * vx;
        const double gax = -gbx - gdx - gex, gay = -gby - gdy - gey, gaz = -gbz - gdz - gez;
        const double slope = w[a] * (gax * gax + gay * gay + gaz * gaz) + w[b] * (gbx * gbx + gby * gby + gbz * gbz)
                           + w[d] * (gdx * gdx + gdy * gdy + gdz * gdz) + w[e] * (gex * gex + gey * gey + gez * gez);
        const double dlam = -(gbx * ux + gby * uy + gbz * uz - rest[c]) / slope;
        const double sa = dlam * w[a], sb = dlam * w[b], sd = dlam * w[d], se = dlam * w[e];
        xa[0] += sa * gax; xa[1] += sa * gay; xa[2] += sa * gaz;
        xb[0] += sb * gbx; xb[1] += sb * gby; xb[2] += sb * gbz;
        xd[0] += sd * gdx; xd[1] += sd * gdy; xd[2] += sd * gdz;
        xe[0] += se * gex; xe[1] += se * gey; xe[2] += se * gez;
    }
}
