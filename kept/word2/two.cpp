#include <gtest/gtest.h>
#include "tests/motion/word_truth.hpp"
using namespace freeflex; using namespace freeflex::testing;
TEST(Two,v){ RandomScene r(31415926102); 
 auto show=[&](const char*n,Scene s,double end){end=std::round(end*s.rate)/s.rate;std::printf("%s\n",n);auto t=true_displacements(s,end);compare_word(s,Fidelity::kSpinLoaded,end,t);};
 Scene s=r.truth(); auto&L=s.loads[0];
 std::printf("rate %g end %g hist %d force %g on %d; points %zu links %zu\n",s.rate,r.end(),(int)L.history.index(),L.forces[0].force.norm(),L.forces[0].point,s.points.size(),s.links.size());
 std::printf("dir %g %g %g spin %g %g %g\n",L.forces[0].force[0],L.forces[0].force[1],L.forces[0].force[2],s.initial.angular_velocity[0],s.initial.angular_velocity[1],s.initial.angular_velocity[2]);
 Faults f;auto st=build_structure(s,f);for(double o:st->omega)std::printf("%.4g ",o);std::printf("\n");
 for(auto&p:s.points)std::printf("%s %g (%g %g %g)\n",p.name.c_str(),p.mass,p.position[0],p.position[1],p.position[2]);
 for(double e:{0.3,0.6,1.0,1.5,2.0,2.5,3.06})show("all",s,e);
 {Scene a=s;a.initial.angular_velocity.setZero();show("no spin",a,3.06);}
 {Scene a=s;a.loads[0].axes=Axes::kBody;show("body",a,3.06);}
 {Scene a=s;a.loads[0].forces[0].force*=0.1;show("load/10",a,3.06);}
 {Scene a=s;a.loads.clear();show("no load",a,3.06);}
 {Scene a=s;a.initial.points.clear();show("no ring",a,3.06);}
 {Scene a=s;a.links.pop_back();show("no dashpot",a,3.06);}
 {Scene a=s;a.rate*=4;show("rate 4",a,3.06);}
}
