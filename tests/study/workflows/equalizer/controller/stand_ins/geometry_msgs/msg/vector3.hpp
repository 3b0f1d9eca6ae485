#pragma once
namespace geometry_msgs::msg {
struct Vector3 { double x = 0.0, y = 0.0, z = 0.0; };
}
