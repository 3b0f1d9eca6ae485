/* As much of CHAI3D's interface as the snippet of docs/controller.md uses: it is compiled, not run. */
#pragma once
#include <memory>

namespace chai3d {
struct cVector3d {
    cVector3d() = default;
    cVector3d(double x, double y, double z) : m{x, y, z} {}
    double x() const { return m[0]; }
    double y() const { return m[1]; }
    double z() const { return m[2]; }
    double m[3] = {0.0, 0.0, 0.0};
};
struct cGenericHapticDevice {
    virtual ~cGenericHapticDevice() = default;
    virtual bool open() { return true; }
    virtual bool close() { return true; }
    virtual bool getPosition(cVector3d &position) { position = cVector3d(); return true; }
    virtual bool setForce(const cVector3d &) { return true; }
};
using cGenericHapticDevicePtr = std::shared_ptr<cGenericHapticDevice>;
}
