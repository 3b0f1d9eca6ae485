/* As much of rclcpp's interface as the node of docs/controller.md uses: it is compiled, not run. */
#pragma once
#include <chrono>
#include <functional>
#include <memory>
#include <string>

namespace rclcpp {
template <typename M> struct Publisher {
    using SharedPtr = std::shared_ptr<Publisher<M>>;
    void publish(const M &) {}
};
template <typename M> struct Subscription {
    using SharedPtr = std::shared_ptr<Subscription<M>>;
};
struct TimerBase {
    using SharedPtr = std::shared_ptr<TimerBase>;
};
struct Node {
    explicit Node(const std::string &) {}
    template <typename M> typename Publisher<M>::SharedPtr create_publisher(const std::string &, int) { return {}; }
    template <typename M>
    typename Subscription<M>::SharedPtr create_subscription(const std::string &, int, std::function<void(const M &)>) { return {}; }
    template <typename D> TimerBase::SharedPtr create_wall_timer(D, std::function<void()>) { return {}; }
};
inline void init(int, char **) {}
inline void spin(const std::shared_ptr<Node> &) {}
inline void shutdown() {}
}
