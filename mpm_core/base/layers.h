#pragma once
/// @file
/// The layers of the core. Each folder is a namespace, `mpm::explicit_scheme` that of `explicit`, a keyword. A layer
/// finds the names of the layers below it unqualified, and those of no other.

namespace mpm
{
namespace base
{
}
namespace mesh
{
using namespace base;
}
namespace materials
{
using namespace base;
}
namespace particles
{
using namespace mesh;
}
namespace parallel
{
using namespace particles;
}
namespace transfer
{
using namespace parallel;
using namespace materials;
} // namespace transfer
namespace contact
{
using namespace transfer;
}
namespace model
{
using namespace contact;
}
namespace explicit_scheme
{
using namespace model;
}
namespace implicit
{
using namespace explicit_scheme;
}
namespace python
{
using namespace implicit;
}
} // namespace mpm
